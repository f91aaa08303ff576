"""Draw the gallery anew: ./run python docs/gallery/make.py [NUMBER...]."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import matplotlib as mpl


def main() -> None:
    """Run the examples of these numbers, or all, and store each figure beside its code."""
    mpl.use("agg")
    for path in sorted(Path(__file__).parent.glob("[0-9]*.py")):
        if len(sys.argv) == 1 or path.stem[:2] in sys.argv[1:]:
            runpy.run_path(str(path))["figure"].savefig(path.with_suffix(".png"), dpi=100)
            print(path.stem, flush=True)


if __name__ == "__main__":  # the examples start processes
    main()
