"""The published study: its stalks, its tables as printed, and checks of their arithmetic.

The names listed in ``__init__.pyi`` are imported when they are first used, so that commands that
need only the name of a stalk do not import statistics packages.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
