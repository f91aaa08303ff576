"""Citation of the published study whose tests the code repeats."""

STUDY = '"Bending mechanics test and parameters calibration of ramie stalks"'
"""Title of the study. The copy used here names no authors, journal, year or DOI."""
