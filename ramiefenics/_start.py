"""Start of MPI, PETSc and FEniCSx that leaves the user's Python settings unchanged.

Imported before all other modules of the package.
"""

import logging
import warnings

import petsc4py
from mpi4py import MPI  # noqa: F401  before PETSc, which would start it without threads


def _start() -> None:
    # PETSc's signal handlers would end the process where Python raises an exception, for example
    # when the other end of a socket or a pipe is closed. If the user has already started PETSc,
    # this call does nothing.
    petsc4py.init(["ramiefenics", "-no_signal_handler"])
    from petsc4py import PETSc

    # Keep PETSc from combining vectors by BLAS matrix-vector products, whose rounding depends on
    # where in memory the numbers happen to be: repeated runs would differ.
    options = PETSc.Options()
    for name in ("vec_mdot_use_gemv", "vec_maxpy_use_gemv"):
        options[name] = False
        options.getBool(name)  # or PETSc would warn of unused options in a process without vectors
    shown_by = warnings.showwarning
    import ffcx  # noqa: F401

    if warnings.showwarning is not shown_by:
        # FFCx redirects all Python warnings to the logging module, which does not show them
        logging.captureWarnings(False)


_start()
