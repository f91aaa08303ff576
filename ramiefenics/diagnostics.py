"""Display of the package's log on standard error.

All modules log to children of the logger ``ramiefenics`` of Python's `logging`: steps, cut-backs
and stored results at level INFO, the residual of every iteration at DEBUG. Nothing is shown, and
the user's logging is not changed, until `show_log` is called or the user configures logging.
"""

from __future__ import annotations

import logging
import sys

LOG = logging.getLogger("ramiefenics")


class _ToStandardError(logging.Handler):
    """Handler that writes to the current standard error, which a progress bar may have replaced."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line, and the traceback if there is one."""
        print(self.format(record), file=sys.stderr, flush=True)


def show_log(level: int) -> None:
    """Show the package's log messages from a level upwards; `logging.NOTSET` changes nothing.

    Parameters
    ----------
    level
        Level of `logging`, such as ``logging.INFO`` or ``logging.DEBUG``.
    """
    if level == logging.NOTSET:
        return
    LOG.setLevel(level)
    if not any(isinstance(handler, _ToStandardError) for handler in LOG.handlers):
        handler = _ToStandardError()
        line = "%(asctime)s %(process)d %(name)s: %(message)s"
        handler.setFormatter(logging.Formatter(line, "%H:%M:%S"))
        LOG.addHandler(handler)
