"""Simulation of bending tests on plant stalks, with FEniCSx.

A `BendingTest` describes the stalk and the test; `simulate` runs it; `write_folder` saves the
result. The public names are listed in ``__init__.pyi`` and imported on first use (Scientific
Python's SPEC 1), because Matplotlib, PyVista and the solver take time to import.
"""

__version__ = "0.1.0"

import lazy_loader

from ramiefenics import _start  # noqa: F401  before everything else

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
