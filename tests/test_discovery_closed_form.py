"""Discovery from folder to verdict, of stalks whose force is a closed formula."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print

import ramiefenics as rf
from ramiefenics.discovery.synthetic import Secret, make_dataset
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

AT_MM = np.linspace(0.0, 16.0, 161)
PARTS_N = {
    ("xylem", "E_Z_MPa"): 20.0 * np.tanh(AT_MM / 3.0),
    ("xylem", "E_X_MPa"): 2.0 * AT_MM,
    ("phloem", "E_Z_MPa"): 40.0 * np.tanh(AT_MM / 8.0),
    ("phloem", "E_X_MPa"): 25.0 * AT_MM / (AT_MM + 4.0),
}
"""What the moduli of a stalk like the published ones bear."""

MESH_ERROR, ORDER = 0.08, 2.0
"""Of the force at 14 mm where cells are 6 mm long, as in the recipe `screening`; of convergence."""

GRADIENT = rf.EFFECTS["stiffness_gradient"]
SUSPECTS = {GRADIENT.name: GRADIENT}


class Formula:
    """Stands in for `Runs`."""

    asked = 0

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        return [Done(self._curve(task)) for task in tasks]

    def _curve(self, task: CurveTask) -> pd.DataFrame:
        force = force_N(task.test)
        slopes = {f.name: (force_N(f.apply(task.test, 0.01)) - force) / 0.01 for f in task.factors}
        return pd.DataFrame({"displacement_mm": AT_MM, "force_N": force, **slopes})


def force_N(test: rf.BendingTest) -> np.ndarray:
    usual, own = (
        {layer.name: layer.material.elastic for layer in stalk.layers}
        for stalk in (rf.ramie(14.4, 7.4, 0.67).stalk, test.stalk)
    )
    shares = {k: getattr(own[k[0]], k[1]) / getattr(usual[k[0]], k[1]) for k in PARTS_N}
    force = sum(share * PARTS_N[key] for key, share in shares.items())
    cells = (test.numerics.mesh.contact_size / 0.06) ** ORDER
    return test.stalk.stiffness_factor * (1.0 + MESH_ERROR * cells * AT_MM / 14.0) * force


def discover(folder: Path, secret: Secret, seed: int, scale: float = 1.0) -> rf.Discovery:
    """Make stalks with moduli known to 5 % and forces too high by a factor; discover."""
    make_dataset(folder, secret, seed, Formula())
    layout = folder / "dataset.toml"
    layout.write_text(re.sub("fit_sd = .*", "fit_sd = 0.05", layout.read_text()))
    for path in (folder / "curves").iterdir():
        curve = pd.read_csv(path)
        curve.assign(force_N=scale * curve["force_N"]).to_csv(path, index=False)
    return rf.discover(folder, SUSPECTS, runs=Formula())


def test_a_load_cell_that_reads_high_is_no_gradient(tmp_path: Path) -> None:
    found = discover(tmp_path / "data", Secret(None), 3, scale=1.15)
    assert found.causes == ()
    own = tmp_path / "own.py"
    own.write_text("a file of suspects")
    found = replace(found, effects={GRADIENT.name: replace(GRADIENT, file=own)})
    rf.write_folder(found, tmp_path / "found")
    assert (tmp_path / "found/own.py").read_text() == "a file of suspects"
    verdict, _ = check_folder(tmp_path / "found", "verdict.json")
    check_print(found, f"p = {found.misfit_p_value:.2g}")
    far = [name for name, move in verdict["log_factors_over_sd"].items() if abs(move) > 2.0]
    assert far  # 15 % is three times 5 %; more than one factor shares it
    told = verdict["findings"][1]
    assert all(name in told for name in far)
    assert "load cell" in told


def test_a_gradient_is_counted_from_the_mean_place(tmp_path: Path) -> None:
    found = discover(tmp_path / "data", Secret(GRADIENT, 0.25), 4)
    assert found.verdict == "cause"
    low, high = found.interval(GRADIENT.name)
    assert low < 0.25 < high
    check_print(found, f"{found.scores[GRADIENT.name].amplitude:.3g}", "(95 % interval")
    places = [s.test.stalk.position_mm for s in found.dataset.specimens]
    extended = found.extended_test().stalk
    assert extended.reference_position_mm == pytest.approx(np.mean(places))
    # a new specimen's moduli follow from its place and the file alone
    amplitude = found.scores[GRADIENT.name].amplitude
    higher = replace(extended, position_mm=extended.reference_position_mm + 100.0)
    assert higher.stiffness_factor == pytest.approx(1.0 + 0.1 * amplitude)


GAP, COMPLIANCE = rf.EFFECTS["seating_gap"], rf.EFFECTS["machine_compliance"]
MOUNTING = replace(COMPLIANCE, name="soft_mounting")


def discover_among(measured: rf.Dataset | Path, *suspects: rf.Effect) -> rf.Discovery:
    return rf.discover(measured, {effect.name: effect for effect in suspects}, runs=Formula())


def change_curves(folder: Path, names: Sequence[str], by: Callable[[np.ndarray], np.ndarray]):
    for name in names:
        path = folder / "curves" / name
        curve = pd.read_csv(path)
        share = by(curve["displacement_mm"].to_numpy())
        curve.assign(force_N=curve["force_N"] * share).to_csv(path, index=False)


def test_nothing_hidden_is_nothing_found(tmp_path: Path) -> None:
    make_dataset(tmp_path, Secret(None), 21, Formula())
    found = discover_among(rf.read_dataset(tmp_path), GAP, COMPLIANCE)
    assert found.verdict == "none"
    assert found.causes == ()
    assert found.extended is None


def test_a_hidden_gap_is_the_cause(tmp_path: Path) -> None:
    make_dataset(tmp_path, Secret(GAP, 0.5), 22, Formula())
    found = discover_among(tmp_path, GAP, COMPLIANCE)
    assert found.verdict == "cause"
    assert found.causes == (GAP.name,)
    low, high = found.interval(GAP.name)
    assert low < 0.5 < high
    assert found.shape_gain is not None
    assert found.shape_gain.shown


def test_two_names_of_one_thing_are_not_told_apart(tmp_path: Path) -> None:
    make_dataset(tmp_path, Secret(COMPLIANCE, 0.02), 23, Formula())
    found = discover_among(tmp_path, GAP, COMPLIANCE, MOUNTING)
    assert found.verdict == "ambiguous"
    assert set(found.causes) == {COMPLIANCE.name, MOUNTING.name}


def test_what_no_suspect_explains_is_unknown(tmp_path: Path) -> None:
    """Forces that swing by a twentieth along the curve, in all specimens."""
    make_dataset(tmp_path, Secret(None), 24, Formula())
    names = [path.name for path in (tmp_path / "curves").iterdir()]
    change_curves(tmp_path, names, lambda d: 1.0 + 0.05 * np.sin(2.0 * np.pi * d / 7.0))
    found = discover_among(tmp_path, GAP, COMPLIANCE)
    assert found.verdict == "unknown"
    assert found.misfit_p_value < 0.001


def test_what_one_specimen_alone_speaks_for_is_no_cause(tmp_path: Path) -> None:
    """The uppermost specimen has a gap, and a suspect is made for it."""
    make_dataset(tmp_path, Secret(None), 25, Formula())
    table = pd.read_csv(tmp_path / "specimens.csv")
    top = table["position_mm"].max()

    def loosen(test: rf.BendingTest, amount: float) -> rf.BendingTest:
        return GAP.apply(test, amount) if test.stalk.position_mm == top else test

    first = Path(table.set_index("position_mm").loc[top, "curve"]).name
    change_curves(tmp_path, [first], lambda d: np.clip(1.0 - 1.0 / np.maximum(d, 1e-9), 0.0, 1.0))
    suspect = replace(GAP, name="loose_on_top", apply=loosen)
    found = discover_among(tmp_path, suspect)
    assert found.causes == ()
    assert "rests on" in found.scores[suspect.name].reason
