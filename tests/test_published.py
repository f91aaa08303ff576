"""Shipped stalks against the printed tables."""

from __future__ import annotations

import pytest

from ramiefenics import SpecificationError, SpecificationWarning, published_test, ramie_at_height


def test_calibration_stalk_is_table_3_with_table_7() -> None:
    with pytest.warns(SpecificationWarning, match=r"3\.09 MPa .* Eq\. 4 gives 0\.88"):
        test = published_test("table3")
    xylem, phloem = test.stalk.layers
    assert (test.stalk.void_diameter_mm, phloem.outer_diameter_mm) == (7.28, 14.23)
    assert (phloem.outer_diameter_mm - xylem.outer_diameter_mm) / 2 == pytest.approx(0.67)
    assert xylem.material.elastic.nu_XY == 0.32
    assert phloem.material.elastic.nu_XY == 0.29
    assert test.fixture.friction.dynamic == 0.12
    assert test.fixture.friction.static == 0.59
    assert (test.fixture.span_mm, test.protocol.travel_mm) == (100.0, 14.0)


@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
@pytest.mark.parametrize(
    ("name", "outer", "inner", "phloem"),
    [
        ("table8-1", 15.1, 7.5, 0.72),
        ("table8-2", 14.3, 7.45, 0.64),
        ("table8-3", 14.7, 7.5, 0.65),
    ],
)
def test_validation_stalks_are_table_8(
    name: str, outer: float, inner: float, phloem: float
) -> None:
    radii = published_test(name).stalk.radii_mm
    assert radii == pytest.approx((inner / 2, outer / 2 - phloem, outer / 2))


def test_stalk_at_height_interpolates_table_1() -> None:
    assert ramie_at_height(0.0).stalk.outer_diameter_mm == 15.70
    assert ramie_at_height(150.0).stalk.void_diameter_mm == pytest.approx(6.20)
    middle = ramie_at_height(75.0).stalk
    assert middle.outer_diameter_mm == pytest.approx((15.70 + 10.90) / 2)
    # the phloem's share of the section is Table 1's ratio of fresh cortex to stalk
    inner, wood, outer = middle.radii_mm
    assert (outer**2 - wood**2) / (outer**2 - inner**2) == pytest.approx(0.2142)


@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
def test_height_by_name() -> None:
    assert published_test("height-69cm") == ramie_at_height(69.0)
    assert published_test("height-12.5cm") == ramie_at_height(12.5)


@pytest.mark.parametrize("height", [-1.0, 151.0])
def test_height_outside_table_1_is_refused(height: float) -> None:
    with pytest.raises(SpecificationError, match="between 0 and 150"):
        ramie_at_height(height)
