"""Many force curves from few simulations."""

from ramiefenics.surrogate.learned import LearnedCurves
from ramiefenics.surrogate.pool import CLOSE_TOLERANCE

__all__ = ["CLOSE_TOLERANCE", "LearnedCurves"]
