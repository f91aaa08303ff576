"""Progress of simulations in the output of a notebook's cell."""

from __future__ import annotations

import sys
import time
from typing import Any

EVERY_S = 0.3
"""Least time between two updates of the display."""


def in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")


class NotebookProgress:
    """Progress bar of simulations, which appears when there is one to do."""

    def __init__(self) -> None:
        self._handle: Any = None
        self._expected = self._done = 0
        self._began = self._shown = 0.0

    def expect(self, number: int) -> None:
        """Add to the number of simulations to do."""
        if number == 0:
            return
        if self._handle is None:
            from IPython.display import HTML, display

            self._began = time.monotonic()
            self._handle = display(HTML(""), display_id=True)
        self._expected += number
        self._show()

    def advance(self, number: int) -> None:
        """Add to the number of simulations done."""
        self._done += number
        now = time.monotonic()
        if self._done == self._expected or now > self._shown + EVERY_S:
            self._show()

    def _show(self) -> None:
        from IPython.display import HTML

        self._shown = time.monotonic()
        seconds = self._shown - self._began
        told = f"{self._done} of {self._expected} simulations, {seconds:.0f} s"
        bar = f'<progress value="{self._done}" max="{self._expected}"></progress> '
        self._handle.update(HTML(told if self._done == self._expected else bar + told))
