"""Many force curves from few simulations."""

from ramiefenics.surrogate.learned import LearnedCurves

__all__ = ["LearnedCurves"]
