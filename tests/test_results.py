"""Files that a run leaves on disk, and messages of the command line."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from conftest import Simulate
from folders import check_folder, check_print
from matplotlib import image

from ramiefenics import (
    BendingResult,
    BendingTest,
    override,
    read_test,
    write_folder,
    write_test,
)
from ramiefenics.cli import main
from ramiefenics.solve import pictures
from ramiefenics.solve.fields import to_grid


@pytest.fixture(scope="module")
def folder(bent: BendingResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(bent, tmp_path_factory.mktemp("run") / "deep" / "out")


def test_curve_reads_back(folder: Path, bent: BendingResult) -> None:
    curve = pd.read_csv(folder / "curve.csv")
    assert list(curve.columns) == list(bent.curve.columns)
    expected = pytest.approx(bent.curve.to_numpy(), rel=1e-7, abs=1e-12, nan_ok=True)
    assert curve.to_numpy() == expected


def test_summary_repeats_the_run(folder: Path, bent: BendingResult) -> None:
    summary = json.loads((folder / "summary.json").read_text())
    curve = bent.curve
    peak = curve["force_N"].idxmax()
    assert summary["max_force_N"] == bent.max_force_N
    # vertex of the parabola: not below the highest step, and between its neighbours
    assert summary["max_force_N"] == pytest.approx(curve["force_N"][peak], rel=2e-3)
    assert summary["max_force_N"] >= curve["force_N"][peak]
    left, right = curve["displacement_mm"][peak - 1], curve["displacement_mm"][peak + 1]
    assert left < summary["displacement_at_max_mm"] < right
    first, last = summary["plateau_mm"]
    assert first < summary["displacement_at_max_mm"] < last
    assert summary["completed"] is True
    assert summary["force_imbalance"] < 1e-3
    assert summary["mesh"] == "screening"
    assert {"dolfinx", "petsc4py", "numpy", "ramiefenics"} <= set(summary["versions"])
    assert read_test(folder / "specification.toml") == bent.test


def test_page_and_print_say_the_same(folder: Path, bent: BendingResult) -> None:
    _, page = check_folder(folder)
    assert page.rows == len(bent.curve) + 1
    check_print(bent, f"{bent.max_force_N:.2f} N at {bent.displacement_at_max_mm:.2f} mm")


@pytest.mark.parametrize("name", ["curve", "deformed", "section"])
def test_pictures_show_something(folder: Path, name: str) -> None:
    pixels = image.imread(folder / f"{name}.png")[..., :3]
    assert min(pixels.shape[:2]) > 400
    background = np.all(pixels > 0.99, axis=2).mean()
    assert 0.2 < background < 0.98


def test_paraview_reads_the_fields(folder: Path, bent: BendingResult) -> None:
    reader = pv.get_reader(folder / "fields" / "bend.pvd")
    assert reader.time_values == [s.travel_mm for s in bent.snapshots]
    reader.set_active_time_value(14.0)
    grid = reader.read()[0]
    assert grid.n_cells == 8 * bent.statistics.cells  # of second order, hence subdivided
    assert list(grid.point_data) == ["displacement_mm"]  # neither codes nor pressures interpolated
    assert {"von_mises_MPa", "axial_stress_MPa", "layer"} <= set(grid.cell_data)
    moved = grid.warp_by_vector("displacement_mm")
    assert moved.compute_cell_sizes()["Volume"].min() > 0


def test_tensors_agree_with_what_is_made_of_them(bent: BendingResult) -> None:
    """Von Mises stress follows from the components, and the volume ratio from the stretches."""
    fields = bent.snapshots[-1].body.cell_data
    xx, yy, zz, xy, yz, xz = fields["stress_MPa"].T
    squares = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    von_mises = np.sqrt(0.5 * squares + 3.0 * (xy**2 + yz**2 + xz**2))
    assert von_mises == pytest.approx(fields["von_mises_MPa"], rel=1e-10)
    stretches = np.column_stack([fields[f"principal_stretch_{n}"] for n in (1, 2, 3)])
    assert np.all(np.diff(stretches, axis=1) >= 0.0)
    e = fields["green_strain"]
    trace = 0.5 * (stretches**2 - 1.0).sum(axis=1)
    assert e[:, :3].sum(axis=1) == pytest.approx(trace, abs=1e-12)
    # the minimum over an element's points is at most little above the value at its middle
    ratio = stretches.prod(axis=1)
    assert np.quantile(fields["min_volume_ratio"] / ratio, 0.99) < 1.05
    start = bent.snapshots[0].body.cell_data
    assert np.abs(start["green_strain"]).max() < 1e-12


def test_paraview_gets_cylinders_numbers_and_a_state(folder: Path, bent: BendingResult) -> None:
    reader = pv.get_reader(folder / "fields" / "fixture.pvd")
    tops = []
    for time in (0.0, 14.0):
        reader.set_active_time_value(time)
        cylinders = reader.read()[0]
        tops.append(cylinders.bounds[3])
        at = bent.curve["displacement_mm"].searchsorted(time)
        assert cylinders.field_data["force_N"][0] == pytest.approx(bent.curve["force_N"][at])
    assert tops[0] - tops[1] == pytest.approx(14.0, abs=1e-4)  # in single precision
    state = (folder / "fields" / "paraview_state.py").read_text()
    compile(state, "paraview_state.py", "exec")
    assert "for normal in [(1, 0, 0), (0, 0, 1)]:" in state  # of the quarter model


def test_state_mirrors_vectors_and_tensors_and_leaves_scalars(folder: Path) -> None:
    """The script of its filter, which ParaView runs with VTK, on the fields of the last step."""
    reader = pv.get_reader(folder / "fields" / "bend.pvd")
    reader.set_active_time_value(14.0)
    grid = reader.read()[0]
    state = (folder / "fields" / "paraview_state.py").read_text()
    script = state.partition('MIRROR = """')[2].partition('"""')[0]
    for axis, sheared in ((0, [3, 5]), (2, [4, 5])):
        output = pv.UnstructuredGrid()
        filter_ = SimpleNamespace(
            GetInputDataObject=lambda *_: grid, GetOutputDataObject=lambda _, o=output: o
        )
        exec(script.replace("AXIS", "XYZ"[axis]), {"self": filter_})
        count = grid.n_cells
        assert output.n_cells == 2 * count
        at = output.cell_centers().points
        assert np.allclose(at[count:], at[:count] * np.where(np.arange(3) == axis, -1.0, 1.0))
        for name, values in output.cell_data.items():
            signs = np.ones(values.shape[1:])
            if name in ("stress_MPa", "green_strain"):
                signs[sheared] = -1.0
            assert np.array_equal(values[count:], signs * values[:count]), name
        u = output.point_data["displacement_mm"]
        assert np.array_equal(u[grid.n_points :, axis], -u[: grid.n_points, axis])


def test_paraview_reads_the_contact(folder: Path, bent: BendingResult) -> None:
    reader = pv.get_reader(folder / "fields" / "contact.pvd")
    assert reader.time_values == [s.travel_mm for s in bent.snapshots]
    reader.set_active_time_value(14.0)
    read = reader.read()[0]
    contact = read.warp_by_vector("displacement_mm")
    states = contact.cell_data["contact_state"]
    assert set(states) <= {0, 1, 2}
    touching = contact.extract_cells(states > 0)
    assert touching.n_cells > 0
    # all of it is on a cylinder of radius 5 mm, into which chords of 3 mm cut by 3^2 / 40 mm
    fixture, stalk = bent.test.fixture, bent.test.stalk
    y, z = touching.cell_centers().points.T[1:]
    indenter = stalk.outer_diameter_mm / 2 + fixture.indenter_radius_mm - 14.0
    support = -stalk.outer_diameter_mm / 2 - fixture.support_radius_mm
    above = z < fixture.span_mm / 4
    away = np.where(
        above,
        np.hypot(y - indenter, z) - fixture.indenter_radius_mm,
        np.hypot(y - support, z - fixture.span_mm / 2) - fixture.support_radius_mm,
    )
    assert np.abs(away).max() < 0.225
    assert np.array_equal(
        read.cell_data["cylinder"], np.where(read.cell_centers().points[:, 1] > 0.0, 0, 1)
    )
    # seen from outside, the undeformed facets face away from the axis
    normals = read.extract_surface(algorithm="dataset_surface").face_normals
    assert np.all((normals * read.cell_centers().points)[:, :2].sum(axis=1) > 0)


def test_facets_have_the_number_of_their_cylinder_in_the_fixture(
    coarse: BendingTest, simulated: Simulate
) -> None:
    """A quarter of a stalk in four-point bending has the first indenter and the first support."""
    result = simulated(override(coarse, ["fixture.inner_span_mm=40"]))
    names = [cylinder.name for cylinder in result.test.fixture.cylinders]
    assert names == ["indenter", "other_indenter", "support", "other_support"]
    contact = result.snapshots[-1].contact
    above = contact.points[contact.cells][:, :, 1].mean(axis=1) > 0.0
    assert np.array_equal(contact.cell_data["cylinder"], np.where(above, 0, 2))


def test_slope_is_the_secant_between_10_and_40_per_cent(bent: BendingResult) -> None:

    travel = np.linspace(0.0, 10.0, 21)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": 7.0 * travel})
    assert dataclasses.replace(bent, curve=curve).slope_N_per_mm == pytest.approx(7.0)


def test_failed_writing_leaves_nothing_half_written(
    bent: BendingResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_folder(bent, tmp_path)
    before = sorted(p.name for p in tmp_path.iterdir())

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(pictures, "deformed_figure", fail)
    with pytest.raises(OSError, match="disk full"):
        write_folder(bent, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_command_writes_the_folder_and_reports(
    coarse: BendingTest,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spec, out = tmp_path / "coarse.toml", tmp_path / "out"
    write_test(coarse, spec)
    monkeypatch.setattr(
        "sys.argv",
        ["ramiefenics", "bend", str(spec), "--out", str(out), "--set", "law=neo_hookean"],
    )
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    told = capsys.readouterr().out
    assert "N at" in told
    assert str(out) in told.replace("\n", "")
    assert read_test(out / "specification.toml").law == "neo_hookean"
    assert (out / "fields" / "bend.pvd").is_file()
    assert (out / "fields" / "contact.pvd").is_file()


def test_command_that_does_not_complete_keeps_results_and_exits_1(
    coarse: BendingTest,
    simulated: Simulate,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spec, out = tmp_path / "coarse.toml", tmp_path / "out"
    write_test(coarse, spec)
    arguments = ["bend", str(spec), "--out", str(out)]
    assignments = [
        "stalk.length_mm=100.2",  # slips off its supports
        "protocol.travel_mm=21",
    ]
    for assignment in assignments:
        arguments += ["--set", assignment]
    monkeypatch.setattr("sys.argv", ["ramiefenics", *arguments])
    monkeypatch.setattr("ramiefenics.solve.simulate.simulate", lambda test, **_: simulated(test))
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 1
    assert "not completed: the stalk has slipped off" in capsys.readouterr().err
    summary = json.loads((out / "summary.json").read_text())
    assert summary["completed"] is False
    assert 0 < summary["reached_mm"] < 21
    assert len(pd.read_csv(out / "curve.csv")) == summary["steps"] + 1


@pytest.mark.parametrize(("order", "pieces"), [(1, 1), (2, 8)])
def test_second_order_cells_appear_as_eight(
    coarse: BendingTest, simulated: Simulate, order: int, pieces: int
) -> None:
    changes = [f"numerics.mesh.order={order}", "numerics.mesh.angular_elements=8"]
    changes.append(f"numerics.mesh.serendipity={str(order == 2).lower()}")  # as in the recipes
    result = simulated(override(coarse, [*changes, "protocol.travel_mm=0.1"]))
    grid = to_grid(result.snapshots[-1].body)
    assert grid.n_cells == pieces * result.statistics.cells
    volumes = grid.compute_cell_sizes()["Volume"]
    assert volumes.min() > 0
    stalk = result.test.stalk
    exact = np.pi * (stalk.radii_mm[-1] ** 2 - stalk.radii_mm[0] ** 2) * stalk.length_mm / 4
    # edges of 180 / n degrees miss (pi / n)^2 / 6 of the circle
    left_out = (np.pi / (8 * order)) ** 2 / 6
    assert volumes.sum() == pytest.approx(exact * (1 - left_out), rel=2e-3)


def test_energies_that_do_not_add_up_are_told(bent: BendingResult) -> None:
    assert not any("work" in note for note in bent.notes())
    wrong = bent.curve.assign(stored_energy_Nmm=0.8 * bent.curve["stored_energy_Nmm"])
    notes = dataclasses.replace(bent, curve=wrong).notes()
    assert any("differs by 20 % from the sum of the energy stored" in note for note in notes)


def test_dissipation_that_is_taken_back_is_told(bent: BendingResult) -> None:
    at = bent.curve["displacement_mm"].to_numpy()
    spent = 10.0 * np.minimum(at, at[-1] - at)  # up, and down again
    (note,) = (
        note
        for note in dataclasses.replace(bent, curve=bent.curve.assign(dissipated_Nmm=spent)).notes()
        if "dissipated by the material falls" in note
    )
    assert f"until {at[-1]:.2f} mm" in note
