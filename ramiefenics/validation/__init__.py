"""Validation: calibrate on some stalks, predict others, and compare with the measurements."""

from ramiefenics.validation.outcome import Validation
from ramiefenics.validation.study import Observation, Split, ValidationStudy, read_validation
from ramiefenics.validation.validate import validate

__all__ = ["Observation", "Split", "Validation", "ValidationStudy", "read_validation", "validate"]
