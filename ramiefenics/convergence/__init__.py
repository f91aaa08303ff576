"""Mesh convergence of a specification on a ladder of meshes: order, limit and error."""

from ramiefenics.convergence.outcome import Convergence
from ramiefenics.convergence.richardson import Extrapolation, order_and_limit
from ramiefenics.convergence.study import converge

__all__ = ["Convergence", "Extrapolation", "converge", "order_and_limit"]
