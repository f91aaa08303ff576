"""Mesh convergence: a specification on a ladder of meshes, order, limit and error."""

from ramiefenics.convergence.richardson import Extrapolation, order_and_limit
from ramiefenics.convergence.study import Convergence, converge

__all__ = ["Convergence", "Extrapolation", "converge", "order_and_limit"]
