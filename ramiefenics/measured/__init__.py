"""Measured force curves, and what was bent to get them."""

from ramiefenics.measured.dataset import Dataset, Specimen, read_dataset

__all__ = ["Dataset", "Specimen", "read_dataset"]
