"""Search for the set of effects that explains the curves best."""
