"""The specifications in docs/examples: each can be read, is documented, and runs."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import pytest
from mpi4py import MPI

import ramiefenics as rf

DOCS = Path(__file__).parents[1] / "docs"
EXAMPLES = sorted((DOCS / "examples").glob("*.toml"))

TINY = [
    "numerics.mesh=ladder_q1_1",
    "numerics.mesh.angular_elements=6",
    "numerics.mesh.wall_elements=1",
    "numerics.mesh.contact_size=0.02",
    "numerics.mesh.coarse_size=0.045",
    "numerics.acoustic_check=false",
    "protocol.travel_mm=0.5",
    "protocol.then=[]",
    "further=[]",
]


def example(path: Path) -> rf.BendingTest:
    """Read an example, which must cause no warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return rf.read_test(path)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_reads_and_is_told_of(path: Path) -> None:
    example(path)
    assert f"(examples/{path.name})" in (DOCS / "model.md").read_text()
    assert f"ramiefenics bend docs/examples/{path.name}" in path.read_text()


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(
            path, id=path.stem, marks=[] if path.stem == "four_point" else pytest.mark.slow
        )
        for path in EXAMPLES
    ],
)
def test_example_runs(path: Path) -> None:
    result = rf.simulate(rf.override(example(path), TINY), MPI.COMM_SELF)
    assert result.completed, result.ending.reason
    last = result.curve.iloc[-1]
    assert last["force_N"] > 0.0
    assert last["support_force_N"] == pytest.approx(last["force_N"], rel=1e-3)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_keep_what_is_not_overridden(path: Path) -> None:
    test = example(path)
    changed = rf.override(test, ["numerics.mesh=standard"])
    assert replace(changed, numerics=test.numerics) == test
