"""Synthetic measurements with hidden effects, to try discovery on."""

from ramiefenics.discovery.synthetic.datasets import Broken, Secret, make_dataset

__all__ = ["Broken", "Secret", "make_dataset"]
