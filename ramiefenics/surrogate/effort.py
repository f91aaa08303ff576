"""Number of curves, and of the simulations that they took."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """Number of force curves, and of the simulations that they took.

    Attributes
    ----------
    curves
        Number of curves asked for.
    simulations
        Number of simulations from which the others were learned, including those done before.
    learned_error
        Largest expected error of a learned curve, relative to its peak; 0 if all were simulated.
    """

    curves: int
    simulations: int
    learned_error: float

    def told(self) -> str:
        """Return the effort as a sentence."""
        if self.learned_error == 0.0:
            return f"All {self.curves} force curves were simulated."
        return (
            f"{self.curves} force curves took {self.simulations} simulations; the others were "
            f"learned from these, to within {100 * self.learned_error:.1g} % of the peak."
        )
