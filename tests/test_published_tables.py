"""The printed tables: typed correctly, consistent with shipped stalks, checked by arithmetic."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

import ramiefenics as rf
from ramiefenics.published import Printed, published_text, recompute
from ramiefenics.published import stalks as shipped
from ramiefenics.published.tables import printed_table


def test_tables_have_the_printed_shape_and_units() -> None:
    rows = {1: 1, 2: 3, 3: 1, 4: 5, 5: 20, 6: 9, 7: 1, 8: 3}
    assert {number: len(rf.published_table(number)) for number in rows} == rows
    assert rf.published_table(1)["whole_plant_height_cm"][0] == 231.4
    assert list(rf.published_table(8).columns[-3:]) == [
        "measured_force_N",
        "simulated_force_N",
        "error_percent",
    ]
    assert printed_table(1)["whole_plant_height_cm"][0] == "231.40"  # zeros as printed
    with pytest.raises(rf.SpecificationError, match="1 to 8"):
        rf.published_table(9)


def test_shipped_stalks_have_the_numbers_of_the_tables() -> None:
    table = rf.published_table(3).iloc[0]
    calibrated = rf.published_table(7).iloc[0]
    for name, layer in (("xylem", shipped.XYLEM), ("phloem", shipped.PHLOEM)):
        elastic = layer.elastic
        for field in ("E_X_MPa", "E_Z_MPa", "G_XZ_MPa", "nu_XZ"):
            assert getattr(elastic, field) == table[f"{name}_{field}"], field
        assert elastic.nu_XY == calibrated[f"{name}_nu_XY"]
        assert layer.density_g_per_cm3 == table[f"{name}_density_g_per_cm3"]
    assert table["phloem_G_XY_MPa"] == shipped.PHLOEM_G_XY_PRINTED_MPA
    stalk = shipped.PUBLISHED["table3"]()
    dimensions = [table[f"{name}_mm"] for name in ("stalk_diameter", "xylem_inner_diameter")]
    assert stalk == rf.ramie(*dimensions, table["phloem_thickness_mm"])
    assert stalk.fixture.friction.static == table["static_friction"]
    assert stalk.fixture.friction.dynamic == calibrated["dynamic_friction"]
    assert tuple(map(tuple, rf.published_table(8).iloc[:, :3].to_numpy())) == shipped.TABLE_8_MM


def test_shipped_heights_have_the_numbers_of_table_1() -> None:
    table, text = rf.published_table(1).iloc[0], published_text().iloc[0]
    for height, end in ((0.0, "root"), (150.0, "top")):
        stalk = rf.ramie_at_height(height).stalk
        assert stalk.outer_diameter_mm == pytest.approx(table[f"{end}_diameter_mm"])
        assert stalk.void_diameter_mm == pytest.approx(table[f"{end}_inner_diameter_mm"])
        inner, wood, outer = stalk.radii_mm
        share = 100 * (outer**2 - wood**2) / (outer**2 - inner**2)
        assert share == pytest.approx(table["cortex_ratio_percent"])
    test = shipped.PUBLISHED["table3"]()
    assert test.fixture.span_mm == text["span_mm"]
    assert test.protocol.travel_mm == text["indenter_travel_mm"]
    assert text["specimen_length_mm"] == shipped.SPECIMEN_LENGTH_MM


def test_responses_of_table_5_have_the_mean_and_total_of_the_other_prints() -> None:
    force = rf.published_table(5)["force_N"]
    assert round(force.mean(), 2) == published_text()["eq5_intercept_N"][0]
    total = rf.published_table(6).set_index("source").loc["Core total", "sum_of_squares_N2"]
    assert ((force - force.mean()) ** 2).sum() == pytest.approx(total, abs=0.05)


def test_x2_repeats_x3_in_table_5_but_for_one_row() -> None:
    table = rf.published_table(5)
    assert table.loc[table["X2"] != table["X3"], "number"].tolist() == [2]


def test_printed_digits_are_kept() -> None:
    assert Printed.read("84.50") == Printed(84.5, 0.005)
    assert Printed.read("320").half == 0.5
    assert Printed.read("1.5e-3").half == pytest.approx(5e-5)
    assert str(Printed.read("84.50")) == "84.50"
    assert Printed.read("0.19").agrees(0.1875)
    assert not Printed.read("0.188").agrees(0.1889)
    assert not Printed.read("1.0").agrees(float("nan"))
    value, low, high = recompute(lambda a, b: a / b, Printed.read("1.0"), Printed.read("2.0"))
    assert (value, low, high) == pytest.approx((0.5, 0.95 / 2.05, 1.05 / 1.95))


def test_checks_find_what_does_not_hold() -> None:
    checks = {(c.where, c.what): c for c in rf.published_checks()}
    wrong = {key: c.recomputed for key, c in checks.items() if not c.holds}
    expected = {
        ("Eq. 2", "constant"): 8 / np.pi,
        ("Table 3", "phloem thickness (mm)"): (14.23 - 12.84) / 2,
        ("Table 3", "phloem G_XY (MPa)"): 2.27 / 2.6,
        ("Table 8", "error of stalk 1 (%)"): 100 * 3.78 / 92.42,
        ("Table 1", "average density of the main stalk (g/cm3)"): 0.955,
    }
    for key, value in expected.items():
        assert wrong.pop(key) == pytest.approx(value, rel=2e-4)
    # by volume, no stalk has Table 1's share of cortex
    assert len(wrong) == 4
    assert all("cortex" in what for _, what in wrong)
    assert checks["Table 3", "xylem G_XY (MPa)"].holds
    assert checks["Table 8", "error of stalk 3 (%)"].holds
    # the phloem's printed G_XY is Eq. 4 with the xylem's modulus, at a level of Table 4
    assert Printed.read("3.09").agrees(7.67 / (2 * 1.24))


def test_table_6_contradicts_itself_where_it_does() -> None:
    found = rf.check_anova(printed_table(6))
    wrong = found[~found["holds"].astype(bool)]
    assert set(zip(wrong["source"], wrong["quantity"], strict=True)) == {
        ("X3", "F"),
        ("X2X3", "F"),
        ("X2X3", "p"),
        ("Residual", "mean square"),
        ("Lack of fit", "mean square"),
    }
    product = wrong[(wrong["source"] == "X2X3")].set_index("quantity")["recomputed"]
    assert product["F"] == pytest.approx(0.21 / (0.52 / 13))
    assert product["p"] == pytest.approx(stats.f.sf(5.25, 1, 13))


@pytest.fixture
def anova() -> pd.DataFrame:
    """Analysis of variance of a regression on one variable, printed to four places."""
    x = np.repeat([0.0, 1.0, 2.0, 3.0], 3)
    y = np.array([1.2, 0.9, 1.1, 2.3, 2.2, 1.8, 2.6, 3.1, 2.9, 4.2, 3.8, 4.4])
    line = stats.linregress(x, y)
    total, model = ((y - y.mean()) ** 2).sum(), ((line.slope * (x - x.mean())) ** 2).sum()
    pure = ((y - np.repeat(y.reshape(4, 3).mean(axis=1), 3)) ** 2).sum()
    residual = total - model
    lack = residual - pure
    f_model, f_lack = model / (residual / 10), (lack / 2) / (pure / 8)
    rows = [
        ("Model", model, 1, model, f_model, line.pvalue),
        ("Residual", residual, 10, residual / 10, None, None),
        ("Lack of fit", lack, 2, lack / 2, f_lack, stats.f.sf(f_lack, 2, 8)),
        ("Pure error", pure, 8, pure / 8, None, None),
        ("Cor total", total, 11, None, None, None),
    ]
    names = ["source", "sum_of_squares", "df", "mean_square", "f_value", "p_value"]
    table = pd.DataFrame(rows, columns=names)
    for name in ("sum_of_squares", "mean_square", "f_value", "p_value"):
        digits = 8 if name == "p_value" else 4
        table[name] = [f"{v:.{digits}f}" if v == v and v is not None else "" for v in table[name]]
    return table


def test_a_right_analysis_of_variance_passes(anova: pd.DataFrame) -> None:
    assert rf.check_anova(anova)["holds"].all()


@pytest.mark.parametrize(
    ("row", "column", "told"),
    [(0, "f_value", "F"), (2, "mean_square", "mean square"), (2, "p_value", "p")],
)
def test_a_wrong_cell_is_found(anova: pd.DataFrame, row: int, column: str, told: str) -> None:
    anova.loc[row, column] = f"{1.1 * float(anova.loc[row, column]):.8f}"
    found = rf.check_anova(anova)
    wrong = found[~found["holds"].astype(bool)]
    assert (anova.loc[row, "source"], told) in set(
        zip(wrong["source"], wrong["quantity"], strict=True)
    )
    assert set(wrong["source"]) == {anova.loc[row, "source"]}


def test_a_wrong_sum_is_found(anova: pd.DataFrame) -> None:
    anova.loc[4, "sum_of_squares"] = "99.0000"
    found = rf.check_anova(anova)
    assert found.loc[~found["holds"].astype(bool), "source"].tolist() == ["Cor total"]
