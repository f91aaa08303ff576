"""From measured and published experiments to calibrated parameters."""
