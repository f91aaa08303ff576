"""Map from a straight circular tube to the stalk's own shape, and back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification import Stalk

Array = NDArray[np.float64]


def stalk_point(stalk: Stalk, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return the position in the stalk of a point of a straight circular tube, mm.

    The bore is moved off the axis, sections are scaled by the taper, flattened if they are elliptic
    and turned, and the axis is bowed.
    """
    flat = stalk.height_mm / stalk.outer_diameter_mm
    angle = math.radians(stalk.rotation_deg)
    cos, sin = math.cos(angle), math.sin(angle)
    inner, outer = stalk.radii_mm[:2]
    scale = stalk.scale_at(z)
    towards_bore = min(max(0.0, outer - math.hypot(x, y)) / (outer - inner), 1.0)
    across, up = scale * x, flat * scale * y + towards_bore * scale * stalk.void_offset_mm
    x, y = cos * across - sin * up, sin * across + cos * up
    return x, *_bowed(stalk, y, z)


def _bowed(stalk: Stalk, y: float, z: float) -> tuple[float, float]:
    """Return Y and Z of a point of the straight stalk once its axis is bowed."""
    if stalk.curvature_per_m == 0.0:
        return y, z
    curvature = stalk.curvature_per_m / 1000.0
    half = curvature * z / 2.0
    drop = 2.0 * math.sin(half) ** 2 / curvature
    return y * math.cos(2.0 * half) - drop, (1.0 / curvature + y) * math.sin(2.0 * half)


def straightened(stalk: Stalk, points: Array) -> Array:
    """Return the positions of points of the stalk if its axis were straight, mm, shape (n, 3)."""
    if stalk.curvature_per_m == 0.0:
        return points
    radius = 1000.0 / stalk.curvature_per_m
    x, y, z = points.T
    away = math.copysign(1.0, radius) * np.hypot(radius + y, z)
    # equal to away - radius, without a difference of large numbers
    above = (2.0 * radius * y + y**2 + z**2) / (away + radius)
    return np.column_stack([x, above, radius * np.arcsin(z / away)])


def round_section(stalk: Stalk, points: Array) -> tuple[Array, Array]:
    """Return X and Y of points of the stalk when it is mapped to a straight circular tube, mm.

    Parameters
    ----------
    stalk
        Stalk, which gives the shape.
    points
        Points in the stalk, shape (n, 3).
    """
    x, y, z = straightened(stalk, points).T
    angle, scale = math.radians(stalk.rotation_deg), stalk.scale_at(z)
    flat = stalk.height_mm / stalk.outer_diameter_mm
    across = (math.cos(angle) * x + math.sin(angle) * y) / scale
    up = (math.cos(angle) * y - math.sin(angle) * x) / (flat * scale)
    if stalk.void_offset_mm == 0.0:
        return across, up
    # within the innermost layer, up is y + slope (outer - rho), rho^2 = x^2 + y^2
    inner, outer = stalk.radii_mm[:2]
    slope = stalk.void_offset_mm / flat / (outer - inner)
    fixed = up - slope * outer
    root = np.sqrt((slope * fixed) ** 2 + (1.0 - slope**2) * (across**2 + fixed**2))
    radius = (slope * fixed + root) / (1.0 - slope**2)
    return across, np.where(radius < outer, fixed + slope * radius, up)
