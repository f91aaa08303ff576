"""Solution of the model: Newton's method, stepping and simulations."""
