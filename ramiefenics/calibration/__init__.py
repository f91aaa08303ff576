"""From designed simulations and measured responses to parameters, and how well they are known."""
