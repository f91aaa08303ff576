"""Comparison of measured curves with simulations of the same tests, or with given ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ramiefenics.comparison.outcome import Comparison, Pair
from ramiefenics.measured import Dataset, read_dataset
from ramiefenics.measured.record import Record
from ramiefenics.runs import Runs, Simulation
from ramiefenics.solve.reading import read_bend
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import BendingTest, MeshRecipe, SpecificationError, mesh_recipe

Simulated = BendingResult | str | Path
"""Result of `simulate`, or its folder."""


def compare(
    dataset: Dataset | str | Path,
    simulated: Simulated | Mapping[str, Simulated] | None = None,
    mesh: str | None = None,
    runs: Runs | None = None,
) -> Comparison:
    """Compare measured curves with simulations.

    Parameters
    ----------
    dataset
        Measured curves, or the folder that holds them.
    simulated
        A simulation or its folder, or several by name, each compared with every measured curve. By
        default every measured test is simulated with its own geometry and conditions and the
        baseline's constants.
    mesh
        Name of the mesh recipe for these simulations; by default that of the data set.
    runs
        Runs the simulations, see `Runs`.

    Raises
    ------
    SpecificationError
        If the data or the simulations cannot be used, or a test cannot be simulated.
    KeyboardInterrupt
        If the user interrupts the simulations; finished ones are kept.
    """
    dataset = dataset if isinstance(dataset, Dataset) else read_dataset(dataset)
    if simulated is None:
        return Comparison(dataset, tuple(_own(dataset, mesh, runs or Runs())))
    return Comparison(
        dataset,
        tuple(
            Pair(record, name, result)
            for name, result in _given(simulated).items()
            for record in dataset.records
        ),
    )


def _given(simulated: Any) -> dict[str, BendingResult]:
    """Return given simulations by name; that of a folder is the folder's."""
    if isinstance(simulated, (str, Path)):
        simulated = {Path(simulated).resolve().name: simulated}
    elif isinstance(simulated, BendingResult):
        simulated = {"simulation": simulated}
    given = dict(simulated) if isinstance(simulated, Mapping) else {}
    for name, one in given.items():
        given[name] = read_bend(one) if isinstance(one, (str, Path)) else one
    if not given or not all(isinstance(one, BendingResult) for one in given.values()):
        kind = f"<{type(simulated).__name__}>"
        allowed = "must be a result of simulate, its folder, or several of these by name"
        raise SpecificationError("simulated", kind, allowed)
    return {str(name): one for name, one in given.items()}


def _own(dataset: Dataset, mesh: str | None, runs: Runs) -> list[Pair]:
    recipe = dataset.layout.mesh if mesh is None else mesh_recipe(mesh)
    tests = [_loading(record, recipe) for record in dataset.records]
    done = runs.map([Simulation(test) for test in tests])
    return [
        Pair(record, "baseline", one.result().result)
        for record, one in zip(dataset.records, done, strict=True)
    ]


def _loading(record: Record, recipe: MeshRecipe) -> BendingTest:
    test = record.test
    travel = float(record.curve["displacement_mm"].iloc[-1])
    protocol = replace(test.protocol, travel_mm=travel, save_every_mm=travel, then=())
    numerics = replace(test.numerics, mesh=recipe, acoustic_check=False)
    return replace(test, protocol=protocol, numerics=numerics)
