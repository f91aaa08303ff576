"""Calibration of parameters by designed simulations, and how well the data determine them."""
