"""From a misprinted design of experiments to the one that was run."""
