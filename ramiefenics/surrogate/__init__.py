"""Many force curves from few simulations."""

from ramiefenics.surrogate.effort import Effort
from ramiefenics.surrogate.learned import LearnedCurves
from ramiefenics.surrogate.pool import CLOSE_TOLERANCE, TIME
from ramiefenics.surrogate.worth import simulations_to_learn

__all__ = ["CLOSE_TOLERANCE", "TIME", "Effort", "LearnedCurves", "simulations_to_learn"]
