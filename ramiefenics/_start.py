"""Starts MPI, PETSc and FEniCSx, and leaves Python as the user had it; imported before all else."""

import logging
import warnings

import petsc4py
from mpi4py import MPI  # noqa: F401  before PETSc, which would start it without threads


def _start() -> None:
    # With its signal handlers PETSc ends the process where Python raises an exception: when the
    # other end of a socket or a pipe is closed. Where PETSc has been started before, by the user,
    # this does nothing.
    petsc4py.init(["ramiefenics", "-no_signal_handler"])
    from petsc4py import PETSc

    # PETSc's vectors are not to be summed by BLAS's matrix-vector products, whose rounding depends
    # on where in memory the numbers happen to be: the same run would differ from time to time.
    options = PETSc.Options()
    for name in ("vec_mdot_use_gemv", "vec_maxpy_use_gemv"):
        options[name] = False
        options.getBool(name)  # else PETSc complains at the end of a process that made no vector
    shown_by = warnings.showwarning
    import ffcx  # noqa: F401

    if warnings.showwarning is not shown_by:
        # FFCx hands all of Python's warnings to the logging module, which shows them to nobody
        logging.captureWarnings(False)


_start()
