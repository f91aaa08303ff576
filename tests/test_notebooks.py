"""Every notebook runs from a fresh kernel."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FIRST, *OTHERS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def executed(path: Path) -> nbformat.NotebookNode:
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=600, resources={"metadata": {"path": path.parent}})
    client.execute()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    return notebook


def test_first_notebook_runs_and_the_announced_warning_shows() -> None:
    cells = executed(FIRST).cells
    announced = next(i for i, c in enumerate(cells) if "The warning is meant" in c.source)
    told = [o.text for o in cells[announced + 1].outputs if o.get("name") == "stderr"]
    assert len(told) == 1
    assert 'SpecificationWarning: Table 3 of "Bending mech' in told[0]


def test_notebooks_are_stored_as_executed() -> None:
    """They contain the output of their cells, and no errors."""
    for path in (FIRST, *OTHERS):
        cells = [c for c in nbformat.read(path, as_version=4).cells if c.cell_type == "code"]
        assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1)), path
        kinds = {output.output_type for cell in cells for output in cell.outputs}
        assert kinds, path
        assert "error" not in kinds, path


@pytest.mark.slow
@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.stem)
def test_other_notebooks_run(path: Path) -> None:
    executed(path)
