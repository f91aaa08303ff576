"""Plant stalks bent on a computer, with FEniCSx."""

__version__ = "0.1.0"
