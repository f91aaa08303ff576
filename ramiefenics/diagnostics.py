"""What the package logs, shown on standard error.

All modules log below the logger ``ramiefenics``, by Python's `logging`: steps, cut-backs and kept
results at its level INFO, residuals of every iteration at DEBUG. Nothing is shown, and nothing of
the user's logging changed, until `show_log` or the user's own set-up asks for it.
"""

from __future__ import annotations

import logging
import sys

LOG = logging.getLogger("ramiefenics")


class _ToStandardError(logging.Handler):
    """Writes to standard error as it is at that moment, progress bars or not."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line, and the traceback if there is one."""
        print(self.format(record), file=sys.stderr, flush=True)


def show_log(level: int) -> None:
    """Show what the package logs from a level on; with `logging.NOTSET` leave all as it is.

    Parameters
    ----------
    level
        As `logging` has it: ``logging.INFO``, ``logging.DEBUG``.
    """
    if level == logging.NOTSET:
        return
    LOG.setLevel(level)
    if not any(isinstance(handler, _ToStandardError) for handler in LOG.handlers):
        handler = _ToStandardError()
        line = "%(asctime)s %(process)d %(name)s: %(message)s"
        handler.setFormatter(logging.Formatter(line, "%H:%M:%S"))
        LOG.addHandler(handler)
