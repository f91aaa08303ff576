"""Order of convergence, Richardson limit and grid-convergence index of a sequence of meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

SAFETY = 1.25
"""Factor of the grid-convergence index where three or more meshes give the order (Roache 1994)."""

LEAST_ORDER = 0.5
"""An order below this is none: the limit would be many times farther away than the last two meshes
are from each other. Oberkampf and Roy (2010, section 8.6) do not believe lower ones either."""

MOST_ORDER = 4.0
"""That of a functional with second-order elements: last two meshes that differ by less than it has
them agree by accident. Celik et al. (2008) warn of it."""

ROUNDING = 1e-10
"""Two values that differ by less, relatively, are the same."""


@dataclass(frozen=True)
class Extrapolation:
    """What a sequence of meshes tells of one quantity.

    Attributes
    ----------
    behaviour
        Of the three finest meshes: ``converging``; ``oscillating`` (to either side, by less and
        less); ``not converging`` (differences that do not shrink, or too slowly for an order of
        `LEAST_ORDER`); ``unchanged`` (the finest two agree to rounding); ``too few`` (fewer than
        three meshes).
    order
        Observed order of convergence; None unless converging.
    limit
        Richardson's, for vanishing mesh size; None unless converging, and where the last two
        meshes agree by accident, see `MOST_ORDER`.
    gci
        Grid-convergence index of the finest mesh, a share of its value; None unless converging or
        oscillating, and where they agree by accident.
    change
        From the second finest mesh to the finest, a share of the finest's value.
    spread
        Half the range of the three finest meshes, a share of the finest's value.
    """

    behaviour: str
    order: float | None = None
    limit: float | None = None
    gci: float | None = None
    change: float | None = None
    spread: float | None = None

    @property
    def uncertainty(self) -> float | None:
        """Error to expect of the finest mesh, a share of its value.

        The grid-convergence index where the sequence converges. Where it oscillates, or the last
        two meshes agree by accident, half the range (Stern, Wilson, Coleman and Paterson 2001,
        eq. 23) if that is more. Where it does not converge, half the range too, and the error may
        well be larger.
        """
        if self.behaviour == "converging" and self.gci is not None:
            return self.gci
        return (
            self.spread if self.gci is None or self.spread is None else max(self.gci, self.spread)
        )


def order_and_limit(sizes: Sequence[float], values: Sequence[float]) -> Extrapolation:
    """Extrapolate a quantity that has been computed on several meshes to vanishing mesh size.

    The procedure of Celik, Ghia, Roache, Freitas, Coleman and Raad (2008) on the three finest
    meshes, whose ratios of refinement r need not be the same. The order p solves its equation,
    ``(phi3 - phi2) / (phi2 - phi1) = s r21^p (r32^p - s) / (r21^p - s)``, with s = 1, or s = -1
    where the differences have opposite signs; index 1 is the finest mesh. The limit is
    ``phi1 + (phi1 - phi2) / (r21^p - 1)``, and the index ``1.25 |phi1 - phi2| / (r21^p - 1)``
    (Roache 1994), divided by ``|phi1|``. For s = -1, p serves the index only and is not given out.

    Parameters
    ----------
    sizes
        Representative cell sizes, in any unit and order; all different.
    values
        The quantity on each mesh; not finite where there is none.

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
    # differences of next to nothing have no relative size
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
    """Return the order whose differences have that ratio; None if no positive one has."""

    def excess(p: float) -> float:
        return p * math.log(r21) + math.log((r32**p - sign) / (r21**p - sign)) - math.log(ratio)

    if ratio == 0.0 or excess(1e-6) >= 0.0:  # it increases with p
        return None
    return float(brentq(excess, 1e-6, _above(excess), xtol=1e-13, rtol=1e-13))


def _above(increasing: Callable[[float], float]) -> float:
    """Return a power of two at which a function is positive."""
    p = 1.0
    while increasing(p) <= 0.0:
        p *= 2.0
    return p
