"""Ctrl-C as a request to stop after the current step, on which all ranks agree."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI


class StopRequest:
    """The user's request to stop."""

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm = comm
        self.asked = False

    def agreed(self) -> bool:
        """Return whether any rank has received the request; collective."""
        return bool(self._comm.allreduce(self.asked, op=MPI.LOR))


@contextmanager
def stop_on_interrupt(comm: MPI.Comm) -> Iterator[StopRequest]:
    """Turn the first Ctrl-C into a `StopRequest`; a second one interrupts at once."""
    request = StopRequest(comm)
    if threading.current_thread() is not threading.main_thread():
        yield request  # only the main thread may set handlers
        return

    def handle(number: int, frame: Any) -> None:
        if request.asked:
            raise KeyboardInterrupt
        request.asked = True

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield request
    finally:
        signal.signal(signal.SIGINT, before)
