"""Every example of the gallery runs and draws a figure, and a picture is stored beside it."""

from __future__ import annotations

import runpy
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

GALLERY = sorted((Path(__file__).parents[1] / "docs" / "gallery").glob("[0-9]*.py"))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
@pytest.mark.parametrize("path", GALLERY, ids=lambda path: path.stem)
def test_example_draws_a_figure(path: Path) -> None:
    with mpl.rc_context({"backend": "agg"}):
        figure = runpy.run_path(str(path), run_name="__main__")["figure"]
    assert isinstance(figure, Figure)
    assert figure.axes
    assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
