"""Importing the package leaves the user's Python settings unchanged, and warnings visible."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import warnings
from pathlib import Path

import pytest

from ramiefenics import BendingTest, override
from ramiefenics.runs import Simulation
from ramiefenics.runs.curve import CurveTask

EVERYTHING = """
    import dolfinx, ufl
    from mpi4py import MPI
    import ramiefenics as rf, ramiefenics.cli, ramiefenics.verification
    for name in rf.__all__:
        getattr(rf, name)
    from ramiefenics.model.jit import compile_form
    mesh = dolfinx.mesh.create_interval(MPI.COMM_SELF, 3, (0.0, 2.0))
    compile_form(dolfinx.fem.Constant(mesh, 1.0) * ufl.dx)
"""
"""Program that imports everything that is imported on demand, and compiles a form."""


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a separate Python, without the environment that MPI has set for this one."""
    own = ("OMPI_", "PMIX_", "PRTE_MCA_")
    environment = {key: value for key, value in os.environ.items() if not key.startswith(own)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, check=True
    )


def script(*parts: str) -> str:
    """Run statements in a separate Python; return its standard error."""
    return python("-c", "\n".join(textwrap.dedent(part) for part in parts)).stderr


def test_importing_the_package_imports_no_solver_and_no_table() -> None:
    """These take a second or two to import, and are imported only when needed."""
    script(
        """
        import sys
        import ramiefenics
        heavy = {"dolfinx", "gmsh", "matplotlib", "pandas", "pyvista", "scipy", "vtk"}
        assert heavy.isdisjoint(sys.modules), heavy.intersection(sys.modules)
        assert "simulate" in dir(ramiefenics)
        """
    )


def test_warnings_reach_the_user() -> None:
    told = script(
        "import warnings; import ramiefenics as rf",  # before FEniCSx
        EVERYTHING,
        'warnings.warn("look here"); rf.published_test("table3")',
    )
    assert told.count("UserWarning: look here") == 1
    assert told.count('SpecificationWarning: Table 3 of "Bending mech') == 1


def test_warnings_go_where_the_user_sends_them() -> None:
    told = script(
        """
        import logging, warnings
        logging.basicConfig(format="%(name)s told: %(message)s")
        logging.captureWarnings(True)
        warnings.filterwarnings("error", "an error")
        import ramiefenics
        warnings.warn("look here")
        try:
            warnings.warn("an error")
        except UserWarning:
            warnings.warn("raised")
        """
    )
    assert told.count("py.warnings told: ") == 2
    assert "UserWarning: look here" in told
    assert "UserWarning: raised" in told


def test_import_leaves_the_process_as_it_was() -> None:
    """The exception is Joblib, which adds an environment variable for Intel's OpenMP."""
    script(
        """
        import locale, logging, os, signal, socket, sys
        import matplotlib, numpy as np
        own = logging.getLogger("ramiefenics")
        def state():
            environment = {k: v for k, v in os.environ.items() if k != "KMP_INIT_AT_FORK"}
            handlers = [signal.getsignal(s) for s in signal.valid_signals()]
            backend = matplotlib.get_backend(auto_select=False)
            return (
                environment, handlers, backend, logging.root.level, logging.root.handlers[:],
                own.handlers[:], own.level,
                np.geterr(), np.random.get_state()[1].tolist(), locale.setlocale(locale.LC_ALL),
                sys.excepthook, sys.path[:], os.getcwd(),
            )
        before = state()
        import ramiefenics
        """,
        EVERYTHING,
        """
        assert state() == before
        one, other = socket.socketpair()
        other.close()
        try:
            one.send(b"to nobody")
        except BrokenPipeError:
            pass
        else:
            raise AssertionError
        """,
    )


@pytest.mark.parametrize(("assignments", "notes"), [([], 1), (["G_XY_MPa=3.09"], 2)])
def test_command_tells_each_warning_once_in_a_sentence(
    assignments: list[str], notes: int, tmp_path: Path
) -> None:
    elastic = "stalk.layers.phloem.material.elastic"
    options = [word for text in assignments for word in ("--set", f"{elastic}.{text}")]
    options += ["--mesh", "ladder_q1_1", "--set", "protocol.travel_mm=0.05"]
    done = python("-m", "ramiefenics", "bend", "table3", *options, "--out", str(tmp_path / "out"))
    told = done.stderr.splitlines()
    assert len(told) == notes
    assert all(line.startswith("note: ") for line in told)
    assert "Warning" not in done.stderr


def test_work_that_needs_no_warnings_leaves_the_users_on(
    coarse: BendingTest, tmp_path: Path
) -> None:
    """Both may run in the user's own process, with one worker or an executor of threads."""
    test = override(coarse, ["protocol.travel_mm=0.2"])
    before = list(warnings.filters)
    CurveTask(test).compute()
    Simulation(test).compute()
    assert list(warnings.filters) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ("specification",),
        ("bend", "--set", "fixture.spam_mm=1"),
        ("bend", "table3", "--mesh", "coars"),
        ("sweep", "table3", "--set", "fixture.indenter_radius=1:2:3"),
        ("plan", "table3", "--also", "fixture.span=50"),
    ],
)
def test_notes_on_constants_are_told_where_something_is_simulated(
    arguments: tuple[str, ...], tmp_path: Path
) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "ramiefenics", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert "note:" not in done.stderr
    assert len(done.stderr.splitlines()) == (0 if done.returncode == 0 else 1)


def test_only_the_packages_own_warnings_become_notes() -> None:
    told = script(
        """
        import warnings
        from ramiefenics.cli.notes import notes
        from ramiefenics.runs.store import StoreWarning
        warnings.showwarning = notes.show
        warnings.warn("columns are not unique")
        warnings.warn("results cannot be kept", StoreWarning)
        """
    )
    assert "UserWarning: columns are not unique" in told
    assert "note: columns" not in told
    assert told.endswith("note: results cannot be kept\n")
