"""Synthetic data sets, made by simulation, with or without effects in them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.discovery.curves.factors import apply_factors, factors
from ramiefenics.discovery.curves.mesh_changes import AFFORDABLE
from ramiefenics.discovery.curves.meshes import on_mesh
from ramiefenics.discovery.synthetic.curves import FINEST, MESH, recorded_rows
from ramiefenics.effects import Effect
from ramiefenics.measured.changes import changed
from ramiefenics.published import ramie
from ramiefenics.runs.curve import Mapper
from ramiefenics.specification import BendingTest, MeshRecipe, Protocol
from ramiefenics.specification.files import value_at

TRAVEL_KEY = "protocol.travel_mm"

TRAVEL_MM, SPEED_MM_PER_S = 14.0, 1.0 / 6.0
GEOMETRY_MM = {"outer_mm": (14.4, 0.5), "void_mm": (7.4, 0.3), "phloem_mm": (0.67, 0.03)}
"""Mean and standard deviation over the specimens, those of Tables 3 and 8."""

HEIGHTS_MM = (0.0, 1200.0)
COMMON_SD, OWN_SD = 0.1, 0.05
"""Standard deviations of the log moduli: of the batch, and of a specimen within it."""

NOISE_SHARE, NOISE_LENGTH_MM, RESOLUTION_N = 0.01, 0.5, 0.1


@dataclass(frozen=True)
class Secret:
    """An effect hidden in a data set.

    Attributes
    ----------
    effect
        The effect; None for nothing.
    amplitude
        Its mean amplitude, in its unit.
    spread
        Standard deviation of the amplitude between specimens, in its unit.
    """

    effect: Effect | None
    amplitude: float = 0.0
    spread: float = 0.0

    def apply(
        self, stalks: Sequence[Sequence[BendingTest]], rng: np.random.Generator
    ) -> list[list[BendingTest]]:
        """Return the tests of every stalk with the effect; a stalk's tests share its amplitude."""
        if self.effect is None:
            return [list(tests) for tests in stalks]
        effect = self.effect.centred([test for tests in stalks for test in tests])
        amplitudes: Array = np.full(len(stalks), self.amplitude)
        if self.spread > 0.0:
            amplitudes = np.clip(rng.normal(amplitudes, self.spread), *effect.bounds)
        pairs = zip(stalks, amplitudes, strict=True)
        return [[effect.apply(test, float(a)) for test in tests] for tests, a in pairs]


@dataclass(frozen=True)
class Broken:
    """A specimen whose forces no simulation reproduces.

    Attributes
    ----------
    specimen
        Its index, counted from 0.
    lost, from_mm
        Share of the force that is missing once it has slipped, and the displacement of the slip.
    scale
        Factor by which its forces are wrong throughout.
    """

    specimen: int = 0
    lost: float = 0.0
    from_mm: float = TRAVEL_MM / 2.0
    scale: float = 1.0

    def force(self, force: Array, at: Array) -> Array:
        """Return the force that is recorded in place of the true one."""
        return np.asarray(self.scale * force * np.where(at >= self.from_mm, 1.0 - self.lost, 1.0))


def make_dataset(
    folder: Path,
    secrets: Secret | Sequence[Secret],
    seed: int,
    runs: Mapper,
    specimens: int = 8,
    mesh: MeshRecipe = MESH,
    finest: MeshRecipe = FINEST,
    travel_mm: float = TRAVEL_MM,
    tests: Sequence[Mapping[str, float]] = ({},),
    noise: float = NOISE_SHARE,
    broken: Sequence[Broken] = (),
    mistaken: Mapping[str, float] | None = None,
    unloaded: bool = False,
) -> None:
    """Write a data set of stalks like the published ones, bent by the full simulator.

    Geometry and moduli scatter. `specimens.csv` contains the geometry, the specimens' place on the
    plant and where their diameters were measured, but not the moduli. Noise is correlated over half
    a millimetre; the load cell resolves 0.1 N.

    Parameters
    ----------
    folder
        Folder to be created.
    secrets
        Hidden effects; several are applied one after the other.
    seed
        Seed of all random numbers.
    runs
        Runs the simulations.
    specimens
        Number of specimens.
    mesh
        Mesh recipe of the simulations.
    finest
        Mesh recipe to which forces are corrected, by what it changes of those of the first stalk,
        without effects if with these it is not `AFFORDABLE`; beyond a fall of the force on it that
        is steeper than `STEEPEST`, by the trend before.
    travel_mm
        Displacement at which the loading ends.
    tests
        Settings of each test that every specimen undergoes, as in `tests.csv`; effects are applied
        on top of these. A stalk is not affected by its earlier tests. A test with a travel of its
        own (`protocol.travel_mm`) ends there.
    noise
        Standard deviation of the noise, relative to the peak force.
    broken
        Specimens that are unlike the others.
    mistaken
        Settings of all tests that do not have their own, which nobody noted: for instance
        ``{"fixture.span_mm": 92.0}`` where `dataset.toml` says 100.
    unloaded
        Whether the curves continue until the stalk is unloaded again.
    """
    rng = np.random.default_rng(seed)
    rows, stalks = _stalks(rng, specimens, mesh, travel_mm)
    settings = [{**(mistaken or {}), **test} for test in tests]
    assignments = [[f"{key}={value!r}" for key, value in each.items()] for each in settings]
    bent = plain = [[changed(stalk, each) for each in assignments] for stalk in stalks]
    for secret in [secrets] if isinstance(secrets, Secret) else secrets:
        bent = secret.apply(bent, rng)
    shown = _shown(bent[0], plain[0])
    ends = [test.protocol.travel_mm for test in plain[0]] * specimens
    curves = iter(recorded_rows(bent, shown, finest, ends, runs, unloaded))
    (folder / "curves").mkdir(parents=True)
    listed = []
    for specimen, row in enumerate(rows):
        for number, told in enumerate(tests, start=1):
            at, force = next(curves)
            for one in broken:
                force = one.force(force, at) if one.specimen == specimen else force
            path = f"curves/{row['specimen']}{f'_{number}' if len(tests) > 1 else ''}.csv"
            _write_curve(folder / path, at, force, noise, rng)
            columns = {key: f"{value:g}" for key, value in told.items() if key != TRAVEL_KEY}
            listed.append({"specimen": row["specimen"], "curve": path, **columns})
    _list(folder, rows, listed, unloaded)


def _shown(
    with_effects: Sequence[BendingTest], without: Sequence[BendingTest]
) -> list[BendingTest]:
    """Return the tests of a stalk that are simulated on the finest mesh."""
    pairs = zip(with_effects, without, strict=True)
    return [one if one.numerics.domain == AFFORDABLE else other for one, other in pairs]


def _write_curve(
    path: Path, at: Array, force: Array, noise: float, rng: np.random.Generator
) -> None:
    along = np.append(0.0, np.abs(np.diff(at)).cumsum())  # the indenter may turn
    force = _noisy(force, along, noise, rng)
    lines = zip(along / SPEED_MM_PER_S, at, force, strict=True)
    text = [(f"{t:.2f}", f"{d:.3f}", f"{f:.1f}") for t, d, f in lines]
    _write(path, ["time_s", "displacement_mm", "force_N"], text)


def _list(
    folder: Path,
    rows: Sequence[dict[str, str]],
    listed: Sequence[dict[str, str]],
    unloaded: bool,
) -> None:
    """Write the tables of specimens and tests, and the `dataset.toml` that describes them."""
    layout = _layout()
    if unloaded:
        layout["then"] = [{"to_mm": 0.0}]
    keys = {key: key for of in listed for key in of if key not in ("specimen", "curve")}
    if len(listed) == len(rows) and not keys:
        rows = [row | {"curve": of["curve"]} for row, of in zip(rows, listed, strict=True)]
    else:
        layout["tests"] = keys
        base = ramie(14.4, 7.4, 0.67)
        usual = {key: f"{value_at(base, key):g}" for key in keys}
        full = [{**usual, **of} for of in listed]
        names = ["specimen", "curve", *keys]
        _write(folder / "tests.csv", names, [[of[name] for name in names] for of in full])
    _write(folder / "specimens.csv", list(rows[0]), [list(row.values()) for row in rows])
    (folder / "dataset.toml").write_text(tomli_w.dumps(layout), encoding="utf-8")


def _stalks(
    rng: np.random.Generator, number: int, mesh: MeshRecipe, travel_mm: float
) -> tuple[list[dict[str, str]], list[BendingTest]]:
    """Return the rows of `specimens.csv`, and the true specifications without effects."""
    positions = rng.permutation(np.linspace(*HEIGHTS_MM, number))
    ends = rng.permutation(np.resize([-90.0, 90.0], number))
    used = factors(ramie(14.4, 7.4, 0.67))
    batch = rng.normal(0.0, COMMON_SD, len(used))
    rows, tests = [], []
    for index in range(number):
        outer, void, phloem = (round(rng.normal(*v), 2) for v in GEOMETRY_MM.values())
        test = ramie(outer, void, phloem)
        stalk = replace(
            test.stalk,
            position_mm=float(round(positions[index])),
            measured_at_mm=float(ends[index]),
        )
        own = batch + rng.normal(0.0, OWN_SD, len(used))
        protocol = Protocol(travel_mm=travel_mm, save_every_mm=travel_mm)
        test = on_mesh(replace(test, stalk=stalk, protocol=protocol), mesh)
        tests.append(apply_factors(test, used, own))
        name = f"S{index + 1:02d}"
        rows.append(
            {
                "specimen": name,
                "outer_mm": f"{outer:.2f}",
                "xylem_mm": f"{outer - 2 * phloem:.2f}",
                "void_mm": f"{void:.2f}",
                "position_mm": f"{stalk.position_mm:g}",
                "measured_at_mm": f"{stalk.measured_at_mm:g}",
            }
        )
    return rows, tests


def _noisy(force: Array, at: Array, share: float, rng: np.random.Generator) -> Array:
    """Add correlated noise, and round to the resolution of the load cell."""
    covariance = np.exp(-np.abs(at[:, None] - at) / NOISE_LENGTH_MM)
    noise = np.linalg.cholesky(covariance + 1e-9 * np.eye(len(at))) @ rng.standard_normal(len(at))
    noisy = force + share * force.max() * noise
    return np.asarray(np.round(noisy / RESOLUTION_N) * RESOLUTION_N)


def _layout() -> dict[str, object]:
    return {
        "title": "Ramie stalks in three-point bending",
        "baseline": "table3",
        "speed_mm_per_min": 60.0 * SPEED_MM_PER_S,
        "fit_sd": COMMON_SD,
        "fixture": {"span_mm": 100.0, "indenter_radius_mm": 5.0, "support_radius_mm": 5.0},
        "specimens": {
            "stalk.layers.phloem.outer_diameter_mm": "outer_mm",
            "stalk.layers.xylem.outer_diameter_mm": "xylem_mm",
            "stalk.void_diameter_mm": "void_mm",
            "stalk.position_mm": "position_mm",
            "stalk.measured_at_mm": "measured_at_mm",
        },
    }


def _write(path: Path, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(head)
        writer.writerows(rows)
