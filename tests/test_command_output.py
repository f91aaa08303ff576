"""Output of commands, as text, JSON or nothing, and the findings of `doctor`."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import ramiefenics
from ramiefenics.cli import app
from ramiefenics.cli.doctor import Finding, findings
from ramiefenics.runs import workers
from ramiefenics.verification import STUDIES


def command(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ramiefenics", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | environment,
    )


def test_json_is_the_summary_and_quiet_is_quiet(tmp_path: Path) -> None:
    printed = command("verify", "constants", "--json", "--out", str(tmp_path / "a"))
    summary = (tmp_path / "a/verification/summary.json").read_text()
    assert json.loads(printed.stdout) == json.loads(summary)
    assert "results in" in printed.stderr
    quiet = command("verify", "constants", "--quiet", "--out", str(tmp_path / "b"))
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")
    assert (tmp_path / "b/verification/summary.json").is_file()


def test_studies_are_listed() -> None:
    lines = command("verify", "list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(STUDIES)
    assert all(len(line.split()) > 3 for line in lines)


def test_doctor_tells_versions_and_what_to_fix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    found = {finding.what: finding for finding in findings()}
    assert found["ramiefenics"] == Finding("ramiefenics", ramiefenics.__version__)
    assert "OMP_NUM_THREADS=1" in found["OMP_NUM_THREADS"].advice
    assert not found["C compiler"].advice
    assert "lib" in found["BLAS"].found
    assert "mumps" in found["PETSc has"].found.split(", ")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CC", "no-such-compiler")
    assert "install a C compiler" in {f.what: f.advice for f in findings()}["C compiler"]


def test_help_begins_with_bend_and_names_the_mesh_recipes() -> None:
    click = typer.main.get_command(app)
    assert next(iter(click.commands)) == "bend"
    mesh = next(one for one in click.commands["bend"].params if one.name == "mesh")
    assert set(ramiefenics.recipe_names()) <= set(re.findall(r"\w+", mesh.help))


@pytest.mark.parametrize(
    ("typed", "offered"),
    [("bend tab", "table3"), ("bend --mesh sc", "screening"), ("bend --law neo", "neo_hookean")],
)
def test_names_are_completed(typed: str, offered: str, monkeypatch: pytest.MonkeyPatch) -> None:
    words = f"ramiefenics {typed}"
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    monkeypatch.setenv("_RAMIEFENICS_COMPLETE", "complete_bash")
    done = CliRunner().invoke(app, [], prog_name="ramiefenics")
    assert offered in done.stdout.split()


@pytest.mark.parametrize("number", [1, 3])
def test_as_many_simulations_at_a_time_as_asked(number: int) -> None:
    with workers(None, number) as pool:
        assert pool._max_workers == number  # type: ignore[attr-defined]
