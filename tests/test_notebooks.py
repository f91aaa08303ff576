"""Every notebook runs from a fresh kernel."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

LONG = [pytest.mark.slow, pytest.mark.long]
NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[] if path == NOTEBOOKS[0] else LONG)
        for path in NOTEBOOKS
    ],
)
def test_notebook_runs(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=600, resources={"metadata": {"path": path.parent}})
    client.execute()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))


def test_announced_warning_shows() -> None:
    """The first notebook says of the specification that it comes with a warning."""
    notebook = nbformat.read(NOTEBOOKS[0], as_version=4)
    announced = next(i for i, c in enumerate(notebook.cells) if "The warning is meant" in c.source)
    notebook.cells = notebook.cells[: announced + 2]
    NotebookClient(notebook, timeout=600).execute()
    told = [o.text for o in notebook.cells[-1].outputs if o.get("name") == "stderr"]
    assert len(told) == 1
    assert 'SpecificationWarning: Table 3 of "Bending mech' in told[0]
