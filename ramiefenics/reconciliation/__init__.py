"""Repair of a misprinted design of experiments: find the design that was run."""
