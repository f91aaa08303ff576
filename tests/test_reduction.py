"""Formulas, statistics and tables of a reduction, against independent results."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print
from matplotlib import image
from scipy.integrate import cumulative_trapezoid

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.measured import RawCurve
from ramiefenics.measured.work import work
from ramiefenics.reduction import describe, equations
from ramiefenics.reduction.groups import ordered
from ramiefenics.validation.strength_rule import by_strength
from ramiefenics.verification.beam import LayeredTube

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

BESIDE = Path(__file__).parents[2] / "shared" / "data" / "maize_brace_roots_2020"
MAIZE = Path(os.environ.get("RAMIEFENICS_MAIZE", BESIDE))
"""Folder of 124 measured curves, not part of this project: doi 10.1093/aob/mcac029."""


def test_equation_1_leaves_the_shear_of_a_beam_with_overhangs() -> None:
    """Timoshenko's beam has f = P L^3 / 48 EI + P L / 4 U and f1 = a P L^2 / 16 EI."""
    load, span, overhang, bending, shear = 20.0, 100.0, 35.0, 1.65e6, 2200.0
    deflection = load * span**3 / (48 * bending) + load * span / (4 * shear)
    upward = overhang * load * span**2 / (16 * bending)
    found = equations.shear_stiffness(load, deflection, span, upward, overhang)
    assert found == pytest.approx(shear, rel=1e-12)
    assert equations.shear_stiffness(load, deflection, span) < 0.6 * shear
    with pytest.raises(ValueError, match="together"):
        equations.shear_stiffness(load, deflection, span, upward)


@pytest.mark.parametrize(("inner", "too_high"), [(13.9, 1.0), (7.0, 2 / 1.70), (0.1, 2 / (7 / 6))])
def test_equation_2_is_a_shear_modulus_exact_for_a_thin_wall(inner: float, too_high: float) -> None:
    """The tube has a shear modulus of 40 MPa, and the stiffness of Saint-Venant's flexure."""
    tube = LayeredTube((inner / 2, 7.0), (320.0,), (40.0,))
    found = equations.shear_modulus(tube.shear_N, 14.0, inner)
    assert found / 40.0 == pytest.approx(too_high, rel=5e-3)
    stiffer = LayeredTube((inner / 2, 7.0), (3200.0,), (40.0,))  # with ten times Young's modulus
    assert equations.shear_modulus(stiffer.shear_N, 14.0, inner) == pytest.approx(found, rel=1e-9)


def test_constant_of_equation_2_is_not_the_printed_one() -> None:
    constant = equations.shear_modulus(1.0, 1.0)
    assert constant == pytest.approx(2.546, abs=5e-4)
    assert abs(constant - 2.564) > 0.017


def test_equation_3_is_the_ring_over_the_tube() -> None:
    outer, inner, phloem = 14.23, 7.28, 0.67
    ring = outer**2 - (outer - 2 * phloem) ** 2
    expected = ring / (outer**2 - inner**2)
    assert equations.phloem_ratio(outer, inner, phloem) == pytest.approx(expected)
    # the stalk at a height follows from Table 1's ratio of fresh cortex, by solving Eq. 3 for h
    stalk = rf.ramie_at_height(69.0).stalk
    xylem, outermost = (layer.outer_diameter_mm for layer in stalk.layers)
    half = (outermost - xylem) / 2
    found = equations.phloem_ratio(outermost, stalk.void_diameter_mm, half)
    assert found == pytest.approx(0.2142, rel=1e-9)


def pressed_beam(span: float, inner: float, stiffness: float) -> tuple[float, float]:
    """Return indenter deflection and largest moment under 1 N in total, by integration."""
    z = np.linspace(0.0, span / 2, 20001)
    moment = np.minimum(z, (span - inner) / 2) / 2
    slope = cumulative_trapezoid(moment / stiffness, z, initial=0.0)
    deflection = cumulative_trapezoid(slope[-1] - slope, z, initial=0.0)
    return float(np.interp((span - inner) / 2, z, deflection)), float(moment.max())


@pytest.mark.parametrize("inner", [0.0, 30.0, 50.0])
def test_bending_modulus_is_that_of_a_beam_with_one_or_two_indenters(inner: float) -> None:
    young, second = 800.0, np.pi / 64 * (14.0**4 - 7.0**4)
    deflection, moment = pressed_beam(150.0, inner, young * second)
    found = equations.bending_modulus(1 / deflection, 150.0, 14.0, 7.0, inner_span_mm=inner)
    assert found == pytest.approx(young, rel=1e-6)  # error of the integration
    stress = equations.maximum_stress(1.0, 150.0 - inner, second / 7.0)
    assert stress == pytest.approx(moment * 7.0 / second, rel=1e-6)


def straight_curve(folder: Path, *changes: str) -> Path:
    """Write a data set of one specimen of 5 N/mm, up to 40 N, with a changed baseline."""
    rf.write_test(rf.override(rf.ramie(14.0, 7.0, 0.7), changes), folder / "mine.toml")
    travel = np.linspace(0.0, 8.0, 81)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": 5.0 * travel})
    records = {"stalk": RawCurve(folder / "stalk.csv", curve)}
    return rf.write_dataset(records, folder / "set", str(folder / "mine.toml"))


def test_four_point_data_are_reduced_by_their_own_formulae(tmp_path: Path) -> None:
    path = straight_curve(tmp_path, "fixture.span_mm=150", "fixture.inner_span_mm=50")
    found = rf.reduce_dataset(path).curves.iloc[0]
    second = np.pi / 64 * (14.0**4 - 7.0**4)
    deflection, moment = pressed_beam(150.0, 50.0, 1.0)
    assert (found["span_mm"], found["inner_span_mm"]) == (150.0, 50.0)
    assert found["bending_modulus_MPa"] == pytest.approx(5.0 * deflection / second, rel=1e-6)
    assert found["strength_MPa"] == pytest.approx(40.0 * moment * 7.0 / second, rel=1e-6)
    # by shear alone a beam with the arm a deflects by P a / 2 U
    shear_stiffness = 5.0 * 50.0 / 2
    assert found["shear_modulus_MPa"] == equations.shear_modulus(shear_stiffness, 14.0, 7.0)


@pytest.mark.parametrize(
    "changes",
    [
        ["fixture.indenter_offset_mm=10", "numerics.domain=half"],
        [f"fixture.{name}" for name in ("span_mm=0", "indenter_radius_mm=inf")],
    ],
)
def test_other_fixtures_are_not_reduced(tmp_path: Path, changes: list[str]) -> None:
    refused = (
        r"fixture = 'indenter above at .* must be that of three- or four-point bending, to which"
    )
    with pytest.raises(rf.SpecificationError, match=refused):
        straight_curve(tmp_path, *changes)
    test = rf.override(rf.ramie(14.0, 7.0, 0.7), changes)
    with pytest.raises(rf.SpecificationError, match=refused):
        by_strength({"stalk": test}, {"stalk": (40.0, 1.0)})
    path = straight_curve(tmp_path)
    rf.write_test(test, path / "baseline.toml")
    text = (path / "dataset.toml").read_text()
    (path / "dataset.toml").write_text(text.replace("[fixture]\nspan_mm = 100.0\n", ""))
    with pytest.raises(rf.SpecificationError, match=rf"dataset\.toml\.{refused}"):
        rf.read_dataset(path)


@pytest.mark.parametrize(("void", "height"), [(0.0, 4.0), (0.0, 2.5), (3.0, 4.0), (3.0, 2.5)])
def test_sections_against_their_integrals(void: float, height: float) -> None:
    """Integrals are sums over the midpoints of strips of up to 1 um in height."""
    width = 4.0
    y = (np.arange(4000) + 0.5) / 4000 * height / 2
    chord = 2 * (width / 2) * np.sqrt(1 - (y / (height / 2)) ** 2)
    inside = np.maximum(1 - (y / (height / 2 * void / width)) ** 2, 0.0) if void else 0.0 * y
    chord = chord - void * np.sqrt(inside)
    step = y[1] - y[0]
    area, second = 2 * np.sum(chord) * step, 2 * np.sum(chord * y**2) * step
    assert equations.section_area(width, void, height) == pytest.approx(area, rel=1e-4)
    found = equations.section_modulus(width, void, height)
    assert found == pytest.approx(second / (height / 2), rel=1e-4)
    slope = 48 * 250.0 * second / 50.0**3
    assert equations.bending_modulus(slope, 50.0, width, void, height) == pytest.approx(
        250, rel=1e-4
    )


def test_equation_7_as_printed() -> None:
    D, d = 14.23, 7.28
    printed = np.pi * (D**4 - d**4) / (32 * D)
    assert equations.section_modulus(D, d) == pytest.approx(printed)
    assert equations.maximum_stress(80.0, 100.0, printed) == pytest.approx(80 * 25 / printed)


def test_confidence_interval_of_a_published_sample() -> None:
    """The 95 % interval is that of NIST/SEMATECH e-Handbook, 1.3.5.2: heat flow meter calibration.

    The sample is another one, made to have the published number, mean and standard deviation.
    """
    draws = np.random.default_rng(4).standard_normal(195)
    values = 9.261460 + 0.02278881 * (draws - draws.mean()) / draws.std(ddof=1)
    found = describe(values)
    assert (found["n"], found["interval"]) == (195, "student")
    assert found["low"] == pytest.approx(9.258242, abs=2e-6)
    assert found["high"] == pytest.approx(9.264679, abs=2e-6)
    # for so many normal values, the bootstrap interval is about the same
    assert found["bootstrap_low"] == pytest.approx(9.258242, abs=3e-4)


def test_skewed_values_get_the_interval_of_the_bootstrap() -> None:
    found = describe(np.random.default_rng(5).lognormal(0.0, 1.0, 60))
    assert found["normal_p"] < 1e-3
    assert found["interval"] == "bootstrap"
    mean = found["mean"]
    assert found["high"] - mean > 1.2 * (mean - found["low"])  # longer on the side of the tail
    assert found["student_high"] - mean == pytest.approx(mean - found["student_low"])


def test_few_skewed_values_get_student_s_interval() -> None:
    # bootstrap intervals of five lognormal values would contain the mean in 80 of 100 cases only
    generator = np.random.default_rng(2)
    found = [describe(generator.lognormal(0.0, 1.0, 5)) for _ in range(30)]
    assert any(f["normal_p"] < 0.05 for f in found)
    assert {f["interval"] for f in found} == {"student"}


@pytest.mark.parametrize(("values", "number"), [([], 0), ([3.0, np.nan], 1), ([3.0, 5.0], 2)])
def test_few_values(values: list[float], number: int) -> None:
    found = describe(np.array(values))
    assert found["n"] == number
    assert np.isfinite(found["low"]) == (number == 2)
    if number == 2:  # Student's t with one degree of freedom is Cauchy's: tan(0.475 pi)
        assert found["high"] - 4.0 == pytest.approx(np.tan(0.475 * np.pi), rel=1e-6)


def test_groups_that_are_numbers_ascend_and_names_stay() -> None:
    assert ordered(["119", "19", "69", "19"]) == ["19", "69", "119"]
    assert ordered(["top", "low", "top"]) == ["top", "low"]


LAYOUT = """
baseline = "table3"
fixture = { span_mm = 80, indenter_radius_mm = 4 }

[specimens]
"stalk.layers.phloem.outer_diameter_mm" = "outer"
"stalk.void_diameter_mm" = "void"
"""
STALKS = {"A": (15.0, 7.0, "low"), "B": (14.0, 7.0, "low"), "C": (13.5, 6.0, "top")}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A data set of curves k d (1 - d / 20) with known results; k is 10, 20 and 30 N/mm."""
    folder = tmp_path / "set"
    folder.mkdir()
    (folder / "dataset.toml").write_text(LAYOUT)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    rows = []
    travel = np.linspace(0.0, 14.0, 1401)
    for index, (name, (outer, void, place)) in enumerate(STALKS.items()):
        path = elsewhere / f"{name}.csv"  # an absolute path, not beside dataset.toml
        force = 10.0 * (index + 1) * travel * (1 - travel / 20.0)
        table = pd.DataFrame({"displacement_mm": travel, "force_N": force})
        table.to_csv(path, index=False)
        rows.append((name, outer, void, place, path))
    columns = ["specimen", "outer", "void", "place", "curve"]
    pd.DataFrame(rows, columns=columns).to_csv(folder / "specimens.csv", index=False)
    return folder


def test_curves_and_groups(folder: Path) -> None:
    found = rf.reduce_dataset(folder, by="place")
    peaks = np.array([50.0, 100.0, 150.0])
    assert found.curves["peak_N"].to_numpy() == pytest.approx(peaks)
    assert found.curves["peak_at_mm"].to_numpy() == pytest.approx(10.0)
    energies = peaks * 2 * (100 / 2 - 1000 / 60) / 10  # k (d^2/2 - d^3/60) at 10 mm
    assert found.curves["energy_to_peak_Nmm"].to_numpy() == pytest.approx(energies, rel=1e-5)
    for peak, (outer, void, _), strength in zip(
        peaks, STALKS.values(), found.curves["strength_MPa"], strict=True
    ):
        moment, W = peak * 80.0 / 4, np.pi * (outer**4 - void**4) / (32 * outer)
        assert strength == pytest.approx(moment / W)
    check_print(found, "low, n = 2", "Peak force 75")
    groups = found.groups.set_index(["group", "quantity"])
    assert groups.loc[("low", "peak_N"), "mean"] == pytest.approx(75.0)
    assert groups.loc[("low", "peak_N"), "sd"] == pytest.approx(50.0 / np.sqrt(2))
    assert groups.loc[("top", "peak_N"), "n"] == 1
    assert np.isnan(groups.loc[("top", "peak_N"), "low"])


def test_panels_of_groups_name_the_quantity_that_differs(folder: Path) -> None:
    figures = rf.reduce_dataset(folder, by="place").figures()
    panels = figures["curves"].figure().axes
    assert [axes.get_title() for axes in panels] == ["Place: low, n = 2", "Place: top, n = 1"]
    assert [axes.get_xlabel() for axes in figures["quantities"].figure().axes][2:] == ["Place"] * 2


def test_heights_of_the_same_plants_are_compared_within_them(folder: Path) -> None:
    travel, rows = np.linspace(0.0, 14.0, 141), []
    for number, height in enumerate(("low", "high")):
        for plant in range(4):
            name, k = f"{height}-{plant}", 10.0 + 10.0 * plant + (1.0 + 0.2 * plant) * number
            force = k * travel * (1 - travel / 20.0)
            table = pd.DataFrame({"displacement_mm": travel, "force_N": force})
            table.to_csv(folder / f"{name}.csv", index=False)
            rows.append((name, 14.0, 7.0, height, f"P{plant}", f"{name}.csv"))
    table.assign(force_N=0.9 * table["force_N"]).to_csv(folder / "alone.csv", index=False)
    rows.append(("alone", 14.0, 7.0, "middle", "P0", "alone.csv"))
    columns = ["specimen", "outer", "void", "height", "plant", "curve"]
    pd.DataFrame(rows, columns=columns).to_csv(folder / "specimens.csv", index=False)
    found = rf.reduce_dataset(folder, by="height", within="plant")
    test = found.tests.set_index("quantity").loc["peak_N"]
    # differences 5.0, 6.0, 7.0 and 8.0 N: mean 6.5, standard error 0.6455, t = 10.07
    assert test["F"] == pytest.approx(6.5**2 / (5.0 / 3.0 / 4.0), rel=1e-3)
    assert test["df_within"] == 3.0
    told = " ".join(found.findings())
    assert "Peak force, test of equal group means: Mixed model, within units, F(1, 3) = 101" in told
    assert "Holm's p = 0.0021, Hedges' g = " in told
    assert "intervals are not adjusted for several comparisons" in told
    notes = " ".join(found.notes())
    assert "height middle: not compared with others, for want of a second plant" in notes
    assert "4 of 4 values of plant occur in several groups of height" in notes
    assert found.numbers()["within"] == "plant"
    apart = rf.reduce_dataset(folder, by="height", within="height, plant")
    assert set(apart.tests["method"]) == {"Welch"}
    alone = rf.reduce_dataset(folder, by="specimen")
    assert "nothing is compared: fewer than two groups of specimen" in " ".join(alone.notes())
    with pytest.raises(rf.SpecificationError, match="within = 'plant' must come with a column"):
        rf.reduce_dataset(folder, within="plant")


def test_seating_of_the_layout_moves_the_curves(folder: Path) -> None:
    before = rf.read_dataset(folder).records[1].curve
    layout = (folder / "dataset.toml").read_text()
    seating = '\n[seating]\nzero = "threshold"\nthreshold_N = 4.0\n'
    (folder / "dataset.toml").write_text(layout + seating)
    after = rf.read_dataset(folder).records[1].curve
    at = 10.0 - np.sqrt(100.0 - 4.0)  # 20 d - d^2 = 4
    moved = before["displacement_mm"].iloc[-1] - after["displacement_mm"].iloc[-1]
    assert moved == pytest.approx(at, abs=1e-4)
    (folder / "dataset.toml").write_text(layout + seating.replace("4.0", "60.0"))
    with pytest.raises(rf.SpecificationError, match=r"row 2 \(A\).*threshold_N = 60.0 must be bel"):
        rf.read_dataset(folder)


def test_preloads_and_load_cells_that_were_not_zeroed_are_told(folder: Path) -> None:
    assert "begin" not in " ".join(rf.reduce_dataset(folder).notes())
    path = folder.parent / "elsewhere" / "A.csv"
    table = pd.read_csv(path)
    table["force_N"] += 4.0
    table.to_csv(path, index=False)
    assert "1 of 3 curves begin with a force of up to 4 N" in " ".join(
        rf.reduce_dataset(folder).notes()
    )
    table["force_N"] -= 8.0
    table.to_csv(path, index=False)
    assert "1 of 3 curves begin with a negative force, down to -4 N" in " ".join(
        rf.reduce_dataset(folder).notes()
    )


def test_a_record_that_begins_at_its_peak_has_no_slope(folder: Path) -> None:
    path = folder.parent / "elsewhere" / "A.csv"
    table = pd.read_csv(path)
    table.loc[0, "force_N"] = 900.0
    table.to_csv(path, index=False)
    found = rf.reduce_dataset(folder)
    assert found.curves["slope_N_per_mm"].isna().tolist() == [True, False, False]
    assert "A: no positive initial slope" in " ".join(found.notes())


@pytest.mark.parametrize("first", [0.0, 0.5])
def test_work_counts_from_contact_on(first: float) -> None:
    travel = np.linspace(first, 2.5, 41)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": 40.0 * travel})
    assert work(curve, 2.0) == pytest.approx(80.0, rel=1e-12)  # 40 * 2^2 / 2
    assert np.isnan(work(curve, 3.0))


def test_curves_begin_where_the_machine_says_by_default(folder: Path) -> None:
    data = rf.read_dataset(folder)
    raw = pd.read_csv(folder.parent / "elsewhere" / "A.csv")
    pd.testing.assert_frame_equal(data.records[0].curve, raw)
    assert data.records[0].row["place"] == "low"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> object:
    monkeypatch.setattr("sys.argv", ["ramiefenics", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        main()
    return stop.value.code or 0


def test_command_writes_tables_figures_and_manifest(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert run(monkeypatch, "reduce", folder, "--by", "place", "--out", out) == 0
    told = capsys.readouterr().out
    assert "low, n = 2" in told
    curves, groups = pd.read_csv(out / "curves.csv"), pd.read_csv(out / "groups.csv")
    assert list(curves["group"]) == ["low", "low", "top"]
    assert set(groups["group"]) == {"low", "top"}
    manifest, _ = check_folder(out, "manifest.json")
    assert manifest["by"] == "place"
    assert manifest["units"]["strength_MPa"] == "MPa"
    assert manifest["specification"]["fixture"]["span_mm"] == 80.0
    for name in ("curves", "quantities"):
        pixels = image.imread(out / f"{name}.png")[..., :3]
        assert 0.2 < np.all(pixels > 0.99, axis=2).mean() < 0.98


def test_command_names_the_columns_there_are(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert run(monkeypatch, "reduce", folder, "--by", "height", "--out", out) == 2
    error = capsys.readouterr().err
    assert "by = 'height' must be a column of specimens.csv or tests.csv (specimen, " in error
    assert not out.exists()


ROOT = """
[fixture]
span_mm = 17.5
indenter_radius_mm = 2.5
support_radius_mm = 2.5

[stalk]
length_mm = 30
void_diameter_mm = 0

[[stalk.layers]]
name = "root"
outer_diameter_mm = 4

[stalk.layers.material]
density_g_per_cm3 = 0.9
elastic = { E_X_MPa = 30, E_Z_MPa = 300, nu_XY = 0.3, nu_XZ = 0.03, G_XZ_MPa = 30 }
"""
ROOTS = """
baseline = "root.toml"

[specimens]
"stalk.layers.root.outer_diameter_mm" = "diameter_major_mm"
"stalk.section_height_mm" = "diameter_minor_mm"

[seating]
zero = "toe"
"""


@pytest.mark.slow
@pytest.mark.skipif(not MAIZE.is_dir(), reason=f"no measured maize roots in {MAIZE}")
def test_maize_roots_have_the_peak_loads_that_their_authors_noted(tmp_path: Path) -> None:
    noted = pd.read_csv(MAIZE / "specimens.csv")
    table = noted.assign(curve=[str((MAIZE / path).resolve()) for path in noted["curve"]])
    table.to_csv(tmp_path / "specimens.csv", index=False)
    (tmp_path / "root.toml").write_text(ROOT)
    (tmp_path / "dataset.toml").write_text(ROOTS)
    found = rf.reduce_dataset(tmp_path, by="genotype")
    curves = found.curves
    assert len(curves) == 124
    # to the last digit noted, 10 uN
    assert curves["peak_N"].to_numpy() == pytest.approx(noted["peak_load_N"].to_numpy(), abs=2e-5)
    lying, upright = noted["diameter_major_mm"], noted["diameter_minor_mm"]
    moment = noted["peak_load_N"] * 17.5 / 4
    expected = moment / (np.pi * lying * upright**2 / 32)
    assert curves["strength_MPa"].to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-5)
    turned = moment / (np.pi * upright * lying**2 / 32)
    assert curves["strength_turned_MPa"].to_numpy() == pytest.approx(turned.to_numpy(), rel=1e-5)
    assert dict(curves["group"].value_counts()) == dict(noted["genotype"].value_counts())
    written = rf.write_folder(found, tmp_path / "out")
    assert len(pd.read_csv(written / "groups.csv")) == 3 * 9
