"""Evidence of sets of effects, fits, their tests, and what they leave open."""
