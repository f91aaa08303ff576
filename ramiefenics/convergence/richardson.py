"""Order of convergence, Richardson limit and grid-convergence index of a sequence of meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

SAFETY = 1.25
"""Safety factor of the grid-convergence index on three or more meshes (Roache 1994)."""

LEAST_ORDER = 0.5
"""Smallest observed order that counts as convergence.

With a lower order the limit would be many times farther away than the last two meshes are from each
other. Oberkampf and Roy (2010, section 8.6) do not trust lower orders either."""

MOST_ORDER = 4.0
"""Largest credible observed order, that of a functional with second-order elements.

If the last two meshes differ by less than this order implies, they agree by accident. Celik et al.
(2008) warn of such agreement."""

ROUNDING = 1e-10
"""Relative difference below which two values count as equal."""


@dataclass(frozen=True)
class Extrapolation:
    """Extrapolation of one quantity from a sequence of meshes.

    Attributes
    ----------
    behaviour
        Behaviour on the three finest meshes: ``converging``; ``oscillating`` (differences of
        alternating sign that decrease); ``not converging`` (differences that do not decrease, or
        more slowly than an order of `LEAST_ORDER` implies); ``unchanged`` (the two finest agree to
        rounding); ``too few`` (fewer than three meshes).
    order
        Observed order of convergence; None unless converging.
    limit
        Richardson limit for vanishing mesh size; None unless converging, and None if the last two
        meshes agree by accident, see `MOST_ORDER`.
    gci
        Grid-convergence index of the finest mesh, relative to its value; None unless converging or
        oscillating, and None if the last two meshes agree by accident.
    change
        Difference between the two finest meshes, relative to the finest's value.
    spread
        Half the range of the three finest meshes, relative to the finest's value.
    """

    behaviour: str
    order: float | None = None
    limit: float | None = None
    gci: float | None = None
    change: float | None = None
    spread: float | None = None

    @property
    def uncertainty(self) -> float | None:
        """Expected error of the finest mesh, relative to its value.

        If the sequence converges, this is the grid-convergence index. If it oscillates, it is the
        larger of the index and half the range of the three finest meshes (Stern, Wilson, Coleman
        and Paterson 2001, eq. 23). It is half the range if the last two meshes agree by accident,
        and also if the sequence does not converge; the error may then well be larger.
        """
        if self.behaviour == "converging" and self.gci is not None:
            return self.gci
        return (
            self.spread if self.gci is None or self.spread is None else max(self.gci, self.spread)
        )


def order_and_limit(sizes: Sequence[float], values: Sequence[float]) -> Extrapolation:
    """Extrapolate a quantity computed on several meshes to vanishing mesh size.

    This is the procedure of Celik, Ghia, Roache, Freitas, Coleman and Raad (2008) on the three
    finest meshes, whose refinement ratios r need not be equal. The order p solves
    ``(phi3 - phi2) / (phi2 - phi1) = s r21^p (r32^p - s) / (r21^p - s)``, with s = 1, or s = -1
    if the differences have opposite signs; subscript 1 is the finest mesh. The limit is
    ``phi1 + (phi1 - phi2) / (r21^p - 1)``, and the grid-convergence index is
    ``1.25 |phi1 - phi2| / (r21^p - 1)`` (Roache 1994), divided by ``|phi1|``. For s = -1, p serves
    the index only and is not returned.

    Parameters
    ----------
    sizes
        Representative cell sizes, in any unit and order; all different.
    values
        The quantity on each mesh; NaN or infinite where it is not known.

    Raises
    ------
    ValueError
        If sizes are not positive, or two are the same.
    """
    if min(sizes, default=1.0) <= 0.0 or len(set(sizes)) < len(sizes):
        raise ValueError(f"sizes must be positive and all different, not {list(sizes)}")
    pairs = sorted(p for p in zip(sizes, values, strict=True) if math.isfinite(p[1]))[:3]
    if len(pairs) < 2:
        return Extrapolation("too few")
    (h1, finest), (h2, second) = pairs[:2]
    # a finest value of zero cannot serve as the scale
    scale = abs(finest) or max(abs(value) for _, value in pairs) or 1.0
    last = second - finest
    change = abs(last) / scale
    if len(pairs) < 3:
        return Extrapolation("too few", change=change)
    h3, third = pairs[2]
    before = third - second
    spread = (max(finest, second, third) - min(finest, second, third)) / 2.0 / scale
    if change <= ROUNDING:
        return Extrapolation("unchanged", change=change, spread=spread)
    r21, r32 = h2 / h1, h3 / h2
    ratio, sign = abs(before / last), math.copysign(1.0, before * last)
    order = _order(ratio, r21, r32, sign)
    if order is None or order < LEAST_ORDER - 1e-9:
        return Extrapolation("not converging", change=change, spread=spread)
    gci = SAFETY * change / (r21**order - 1.0)
    if sign < 0.0:
        index = gci if order <= MOST_ORDER else None
        return Extrapolation("oscillating", gci=index, change=change, spread=spread)
    if order > MOST_ORDER:
        return Extrapolation("converging", order, change=change, spread=spread)
    limit = finest - last / (r21**order - 1.0)
    return Extrapolation("converging", order, limit, gci, change, spread)


def _order(ratio: float, r21: float, r32: float, sign: float) -> float | None:
    """Return the order at which the differences have this ratio; None if it is not positive."""

    def excess(p: float) -> float:
        return p * math.log(r21) + math.log((r32**p - sign) / (r21**p - sign)) - math.log(ratio)

    if ratio == 0.0 or excess(1e-6) >= 0.0:  # the excess increases with p
        return None
    return float(brentq(excess, 1e-6, _above(excess), xtol=1e-13, rtol=1e-13))


def _above(increasing: Callable[[float], float]) -> float:
    """Return a power of two at which a function is positive."""
    p = 1.0
    while increasing(p) <= 0.0:
        p *= 2.0
    return p
