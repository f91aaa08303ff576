"""Parameter sweeps: one specification with some of its values varied."""

from ramiefenics.sweep.outcome import Sweep
from ramiefenics.sweep.study import sweep, values_by_key, values_of

__all__ = ["Sweep", "sweep", "values_by_key", "values_of"]
