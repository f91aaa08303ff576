"""Work done by the indenter."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from scipy.integrate import trapezoid


def work(curve: pd.DataFrame, to_mm: float) -> float:
    """Return the work done up to a displacement, N mm, by the trapezoidal rule.

    If the record begins later than at 0 mm, the force is taken to rise linearly until then.

    Parameters
    ----------
    curve
        ``displacement_mm``, ascending, and ``force_N``.
    to_mm
        Displacement; if it is beyond the record, the result is NaN.
    """
    first = [0.0] if curve["displacement_mm"].iloc[0] > 0.0 else []
    travel = np.append(first, curve["displacement_mm"])
    force = np.append(first, curve["force_N"])
    before = travel < to_mm
    last = np.interp(to_mm, travel, force, left=math.nan, right=math.nan)
    return float(trapezoid(np.append(force[before], last), np.append(travel[before], to_mm)))
