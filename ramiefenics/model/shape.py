"""From a straight circular tube to the stalk's own shape, and back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification import Stalk

Array = NDArray[np.float64]


def stalk_point(stalk: Stalk, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return where the stalk has a point of a straight circular tube, mm.

    First the bore is moved off the axis, then sections are scaled by the taper, and elliptic ones
    are flattened and turned.
    """
    flat = stalk.height_mm / stalk.outer_diameter_mm
    angle = math.radians(stalk.rotation_deg)
    cos, sin = math.cos(angle), math.sin(angle)
    inner, outer = stalk.radii_mm[:2]
    scale = stalk.scale_at(z)
    towards_bore = min(max(0.0, outer - math.hypot(x, y)) / (outer - inner), 1.0)
    across, up = scale * x, flat * scale * y + towards_bore * scale * stalk.void_offset_mm
    return cos * across - sin * up, sin * across + cos * up, z


def round_section(stalk: Stalk, points: Array) -> tuple[Array, Array]:
    """Return X and Y that points of the stalk have on the straight circular tube, mm.

    Parameters
    ----------
    stalk
        Gives the shape.
    points
        In the stalk, shape (n, 3).
    """
    x, y, z = points.T
    angle, scale = math.radians(stalk.rotation_deg), stalk.scale_at(z)
    flat = stalk.height_mm / stalk.outer_diameter_mm
    across = (math.cos(angle) * x + math.sin(angle) * y) / scale
    up = (math.cos(angle) * y - math.sin(angle) * x) / (flat * scale)
    if stalk.void_offset_mm == 0.0:
        return across, up
    # up there is y + slope (outer - r) with r^2 = x^2 + y^2, within the innermost layer
    inner, outer = stalk.radii_mm[:2]
    slope = stalk.void_offset_mm / flat / (outer - inner)
    fixed = up - slope * outer
    root = np.sqrt((slope * fixed) ** 2 + (1.0 - slope**2) * (across**2 + fixed**2))
    radius = (slope * fixed + root) / (1.0 - slope**2)
    return across, np.where(radius < outer, fixed + slope * radius, up)
