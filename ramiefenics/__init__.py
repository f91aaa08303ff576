"""Plant stalks bent on a computer, with FEniCSx.

A `BendingTest` says what is bent and how; `simulate` bends it; `write_folder` keeps what came out.
What the package offers is listed in ``__init__.pyi`` and imported when it is first used (Scientific
Python's SPEC 1), as Matplotlib, PyVista and the solver take their time.
"""

__version__ = "0.1.0"

import lazy_loader

from ramiefenics import _start  # noqa: F401  first

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
