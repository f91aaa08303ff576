"""Properties that hold for any input: files read back, curves and sections scale."""

from __future__ import annotations

import json
import math
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ramiefenics as rf
from ramiefenics.measured import initial_slope
from ramiefenics.measured.tables import UNITS
from ramiefenics.measured.work import work
from ramiefenics.reduction.equations import maximum_stress, section_modulus
from ramiefenics.specification.files import dump_test, test_from_dict, to_dict

few = settings(derandomize=True, max_examples=25, deadline=None, database=None)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


factors = numbers(0.01, 100.0)


@st.composite
def fixtures(draw: st.DrawFn) -> rf.Fixture | rf.GeneralFixture:
    """Draw three- and four-point bending, on and off centre, plates, and cylinders one by one."""
    radius = numbers(1.0, 7.0)
    kind = draw(st.sampled_from(["beam", "plates", "stated"]))
    if kind == "plates":
        return rf.Fixture(0.0, draw(radius | st.just(math.inf)), math.inf)
    if kind == "beam":
        span, inner = draw(numbers(90.0, 150.0)), draw(st.just(0.0) | numbers(15.0, 40.0))
        offset, other = draw(st.just(0.0) | numbers(-5.0, 5.0)), draw(st.none() | radius)
        friction = rf.Friction(0.3, draw(numbers(0.0, 0.3)))
        return rf.Fixture(span, draw(radius), draw(radius), friction, inner, offset, other)
    places = [draw(numbers(at - 4.0, at + 4.0)) for at in (0.0, 60.0, -60.0, 30.0)]
    rigid = [
        rf.Cylinder("nose", "above", True, places[0], draw(radius)),
        rf.Cylinder("right", "below", False, places[1], draw(radius)),
        rf.Cylinder("left", "below", False, places[2], draw(radius)),
        rf.Cylinder("clamp", "above", draw(st.booleans()), places[3], draw(radius)),
    ]
    return rf.GeneralFixture(tuple(rigid[: draw(st.integers(3, 4))]))


@st.composite
def specifications(draw: st.DrawFn) -> rf.BendingTest:
    """Draw a specification: one to three layers of any stable material, any fixture."""
    walls = draw(st.lists(numbers(0.2, 3.0), min_size=1, max_size=3))
    void = draw(numbers(0.0, 8.0))
    layers = []
    for number, outer in enumerate(void + 2.0 * np.cumsum(walls)):
        across, along = draw(numbers(1.0, 50.0)), draw(numbers(100.0, 5000.0))
        elastic = rf.Elastic(across, along, draw(numbers(-0.3, 0.5)), 0.001, draw(factors))
        large_strain = rf.LargeStrain(densification=draw(numbers(0.0, 20.0)))
        density = draw(numbers(0.1, 1.5))
        layers.append(
            rf.Layer(f"layer_{number}", outer, rf.Material(elastic, large_strain, density))
        )
    fixture = draw(fixtures())
    recipe = rf.mesh_recipe(draw(st.sampled_from(rf.recipe_names())))
    numerics = rf.Numerics(mesh=recipe, domain="quarter" if fixture.symmetric else "half")
    height = draw(st.none() | numbers(5.0, 20.0))
    stalk = rf.Stalk(180.0, void, tuple(layers), section_height_mm=height)
    return rf.BendingTest(stalk, fixture, numerics=numerics)


@few
@given(test=specifications())
def test_a_specification_reads_back_equal(test: rf.BendingTest) -> None:
    assert test_from_dict(tomllib.loads(dump_test(test))) == test
    assert test_from_dict(json.loads(json.dumps(to_dict(test), allow_nan=False))) == test


TRAVEL = np.linspace(0.0, 14.0, 57)
FORCE = 84.0 * np.sin(np.pi * TRAVEL / 20.0)


def read(text: str, format: str, **options: object) -> pd.DataFrame:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stalk.txt"
        path.write_text(text)
        (raw,) = rf.read_raw([path], format, **options).values()
    return raw.curve


def cells(length: str, force: str, comma: bool) -> list[tuple[str, str]]:
    """Return the curve in these units, to nine digits, with a decimal comma or point."""
    made = []
    for d, f in zip(TRAVEL / UNITS["mm"][length], FORCE / UNITS["N"][force], strict=True):
        row = f"{d:.9e}", f"{f:.9e}"
        made.append(tuple(cell.replace(".", ",") if comma else cell for cell in row))
    return made


lengths, forces = st.sampled_from(sorted(UNITS["mm"])), st.sampled_from(sorted(UNITS["N"]))


def check(curve: pd.DataFrame) -> None:
    assert curve["displacement_mm"].to_numpy() == pytest.approx(TRAVEL, abs=1e-6)
    assert curve["force_N"].to_numpy() == pytest.approx(FORCE, abs=1e-6)


@few
@given(
    length=lengths,
    force=forces,
    between=st.sampled_from([";", "\t", "  ", " ; "]),
    comma=st.booleans(),
)
def test_columns_read_back(length: str, force: str, between: str, comma: bool) -> None:
    rows = [between.join(row) for row in cells(length, force, comma)]
    columns = (f"displacement_{length}", f"force_{force}")
    check(read("\n".join(["# from a machine", *rows]), "columns", columns=columns))


@few
@given(
    length=lengths,
    force=forces,
    between=st.sampled_from([",", ";", "\t"]),
    comma=st.booleans(),
    beside=st.booleans(),
)
def test_bluehill_reads_back(
    length: str, force: str, between: str, comma: bool, beside: bool
) -> None:
    names, units = ["Extension", "Load"], [f"({length})", f"({force})"]
    if beside:
        heading = [between.join(f"{n} {u}" for n, u in zip(names, units, strict=True))]
    else:
        heading = [between.join(names), between.join(units)]
    rows = [between.join(f'"{cell}"' for cell in row) for row in cells(length, force, comma)]
    check(read("\n".join(["", *heading, *rows]), "headings"))


@few
@given(force=factors, length=factors)
def test_readings_of_a_curve_scale_with_it(force: float, length: float) -> None:
    curve = pd.DataFrame({"displacement_mm": TRAVEL, "force_N": FORCE})
    scaled = pd.DataFrame({"displacement_mm": length * TRAVEL, "force_N": force * FORCE})
    slope, other = initial_slope(curve), initial_slope(scaled)
    assert other.N_per_mm == pytest.approx(slope.N_per_mm * force / length, rel=1e-9)
    assert work(scaled, 14.0 * length) == pytest.approx(work(curve, 14.0) * force * length)


@few
@given(size=factors, strength=factors, void=numbers(0.0, 0.95), aspect=numbers(0.5, 2.0))
def test_a_stalk_of_twice_the_size_bears_four_times_the_force(
    size: float, strength: float, void: float, aspect: float
) -> None:
    """Stresses in similar beams are equal if forces grow like areas (Galilei 1638)."""
    small = section_modulus(10.0, 10.0 * void, 10.0 * aspect)
    large = section_modulus(10.0 * size, 10.0 * void * size, 10.0 * aspect * size)
    stress = maximum_stress(50.0, 100.0, small)
    scaled = maximum_stress(50.0 * strength * size**2, 100.0 * size, large)
    assert scaled == pytest.approx(strength * stress, rel=1e-12)
