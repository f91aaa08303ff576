"""Progress bars in the output of a notebook's cell."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

EVERY_S = 0.3
"""Least time between two updates of the display."""


def in_notebook() -> bool:
    """Return whether this is the main thread of a notebook's kernel, which executes its cells."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    kernel = shell is not None and hasattr(shell, "kernel")
    return kernel and threading.current_thread() is threading.main_thread()


@contextmanager
def notebook_bar(total: float) -> Iterator[Callable[[float, str], None]]:
    """Provide a function that shows how much of the total is done, and a text, in notebooks only.

    When the block ends, the text stays, and the bar does not.
    """
    if not in_notebook():
        yield lambda done, told: None
        return
    bar = NotebookBar()
    try:
        yield lambda done, told: bar.show(done, total, told)
    finally:
        bar.end()


class NotebookBar:
    """Progress bar, which appears when it is shown first and goes when all is done."""

    def __init__(self) -> None:
        self._handle: Any = None
        self._began = self._shown = self._total = 0.0
        self._told = ""

    def show(self, done: float, total: float, told: str) -> None:
        """Show how much of the total is done, a text and the time since the bar appeared."""
        now = time.monotonic()
        if self._handle is None:
            from IPython.display import HTML, display

            self._began, self._handle = now, display(HTML(""), display_id=True)
        self._told = f"{told}, {now - self._began:.0f} s"
        if done >= total:
            self.end()
        elif total != self._total or now > self._shown + EVERY_S:
            self._shown = now
            self._update(f'<progress value="{done:g}" max="{total:g}"></progress> {self._told}')
        self._total = total

    def end(self) -> None:
        """Remove the bar, and leave the last text."""
        if self._handle is not None:
            self._update(self._told)

    def _update(self, html: str) -> None:
        from IPython.display import HTML

        self._handle.update(HTML(html))


class NotebookProgress:
    """Progress bar of simulations, which appears when there is one to do."""

    def __init__(self) -> None:
        self._bar = NotebookBar()
        self._expected = self._done = 0

    def expect(self, number: int) -> None:
        """Add to the number of simulations to do."""
        if number > 0:
            self._expected += number
            self._show()

    def advance(self, number: int) -> None:
        """Add to the number of simulations done."""
        self._done += number
        self._show()

    def _show(self) -> None:
        told = f"{self._done} of {self._expected} simulations"
        self._bar.show(self._done, self._expected, told)
