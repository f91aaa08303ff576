"""The published study whose tests the code repeats, as far as the copy at hand names it."""

STUDY = '"Bending mechanics test and parameters calibration of ramie stalks"'
"""Title; the copy prints neither authors nor journal, year or DOI."""
