"""From a model to its answer: Newton, stepping, the simulation."""
