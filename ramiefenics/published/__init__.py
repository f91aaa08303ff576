"""The published study: its stalks, its tables as printed, and the arithmetic that they obey.

What is offered is listed in ``__init__.pyi`` and imported when it is first used: commands that need
a stalk's name alone need no statistics.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
