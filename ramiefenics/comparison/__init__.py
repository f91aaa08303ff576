"""Comparison of measured force curves with simulated ones."""

from ramiefenics.comparison.compare import compare
from ramiefenics.comparison.outcome import Comparison, Pair

__all__ = ["Comparison", "Pair", "compare"]
