"""Assign printed rows to the points of a central composite design by a linear program.

Which row was run at which point is an assignment problem. The coefficients of a least-squares model
are linear in the responses at given points. A published coefficient, known to half a unit of its
last digit, is therefore a pair of linear inequalities. A sum of squares with one degree of freedom
is another pair for either sign of its coefficient. Finding the least change that satisfies all of
them is a mixed-integer linear program. It is solved by branch and cut (HiGHS, Huangfu & Hall 2018),
which proves that there is no smaller change without trying the arrangements one by one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

from ramiefenics.calibration.terms import model_matrix
from ramiefenics.published.rounding import SLACK
from ramiefenics.reconciliation.printed_design import PrintedDesign, Publication
from ramiefenics.specification import SpecificationError

SAME = 0.01
"""Difference below which coded levels, such as 1.682 and 1.68179, count as equal."""

TIME_LIMIT_S = 120.0
"""Time limit of one linear program; with three factors, it takes hundredths of a second."""


def composite_points(factors: int, alpha: float) -> NDArray[np.float64]:
    """Return the points of a central composite design (Box & Wilson 1951), the centre last.

    Parameters
    ----------
    factors
        Number of factors, k.
    alpha
        Distance of the axial points from the centre.

    Returns
    -------
    numpy.ndarray
        Shape (2^k + 2k + 1, k).
    """
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=factors)))
    axes = alpha * np.eye(factors)
    return np.vstack([corners, -axes, axes, np.zeros((1, factors))]) + 0.0  # turns -0.0 into 0.0


@dataclass(eq=False)
class Arrangements:
    """All ways to assign the rows of a printed design to the points of a central composite one.

    A row of -1 and 1 remains a factorial row and may change its signs. A row of 0 and alpha remains
    an axial or centre row and may change its axis or its sign, or move to or from the centre. A row
    with any other level may be assigned to any point.

    Parameters
    ----------
    design
        Design as printed.
    publication
        Results that the arranged design must reproduce.
    """

    design: PrintedDesign
    publication: Publication

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """Points of the central composite design, shape (points, factors)."""
        return composite_points(len(self.design.factors), self.design.alpha)

    @cached_property
    def capacity(self) -> NDArray[np.float64]:
        """Number of rows that are assigned to each point, shape (points,)."""
        taken = np.ones(len(self.points))
        taken[-1] = len(self.design.points) - len(self.points) + 1
        return taken

    @cached_property
    def cells(self) -> NDArray[np.float64]:
        """Number of cells that differ between each row and each point, shape (rows, points)."""
        differs = np.abs(self.design.points[:, None] - self.points[None]) > SAME
        return differs.sum(axis=2).astype(float)

    @cached_property
    def allowed(self) -> NDArray[np.bool_]:
        """Whether a row may be assigned to a point, shape (rows, points)."""
        levels = np.abs(self.design.points)
        corner = np.all(np.abs(levels - 1.0) < SAME, axis=1)
        on_axis = np.all((levels < SAME) | (np.abs(levels - self.design.alpha) < SAME), axis=1)
        if self.design.alpha - 1.0 < SAME:  # levels alone do not tell corners from axial points
            on_axis &= (levels > SAME).sum(axis=1) <= 1
        factorial = np.arange(len(self.points)) < 2 ** len(self.design.factors)
        return np.where(
            corner[:, None], factorial, np.where(on_axis[:, None], ~factorial, True)
        ).astype(bool)

    @cached_property
    def demanded(self) -> int:
        """Number of rows that must change to give a central composite design.

        This does not depend on what was published.
        """
        held = (self.cells == 0).sum(axis=0)
        return int(len(self.design.points) - np.minimum(held, self.capacity).sum())

    @property
    def is_composite(self) -> bool:
        """Whether the printed design already is a central composite design."""
        return self.demanded == 0

    def search(self, most_rows: int) -> Iterator[NDArray[np.intp]]:
        """Yield arrangements, each as the index of the point of each row.

        Those with the fewest changed rows come first, and among these, those with the fewest
        changed cells. Arrangements with the same responses at every point are yielded only once.

        Parameters
        ----------
        most_rows
            Largest number of changed rows.

        Raises
        ------
        SpecificationError
            If a linear program is not solved within `TIME_LIMIT_S`, or if the model has more terms
            than a central composite design can tell apart.
        """
        cuts: list[NDArray[np.float64]] = []
        while (found := self._solve(most_rows, cuts)) is not None:
            yield found
            cuts.append(self._same_responses(found))

    def _same_responses(self, arranged: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return coefficients that count the points, except the centre, with these responses."""
        responses = self.design.responses
        counts = np.zeros_like(self.cells)
        for point in range(len(self.points) - 1):
            counts[:, point] = responses == responses[arranged == point][0]
        return counts.ravel()

    def _solve(self, most_rows: int, cuts: list[NDArray[np.float64]]) -> NDArray[np.intp] | None:
        rows, points = self.cells.shape
        published, low, high = self._published
        signs = published.shape[1] - self.cells.size
        changed = (self.cells > 0).ravel().astype(float)
        weight = rows * len(self.design.factors) + 1  # one changed row outweighs all changed cells
        once, filled = np.kron(np.eye(rows), np.ones((1, points))), np.tile(np.eye(points), rows)
        arranging = np.vstack([once, filled, changed, *cuts])
        exactly, free = np.append(np.ones(rows), self.capacity), np.zeros(1 + len(cuts))
        limits = np.append(float(most_rows), np.full(len(cuts), points - 2.0))
        answer = milp(
            np.append(weight * changed + self.cells.ravel(), np.zeros(signs)),
            constraints=LinearConstraint(
                np.vstack([np.pad(arranging, ((0, 0), (0, signs))), published]),
                np.concatenate([exactly, free, low]),
                np.concatenate([exactly, limits, high]),
            ),
            integrality=np.ones(self.cells.size + signs),
            bounds=Bounds(0, np.append(self.allowed.ravel().astype(float), np.ones(signs))),
            options={"time_limit": TIME_LIMIT_S, "mip_rel_gap": 0.0},
        )
        if answer.status == 2:
            return None
        if answer.status != 0:
            raise SpecificationError(
                "the printed design", None, f"could not be arranged within {TIME_LIMIT_S:g} s"
            )
        return np.asarray(answer.x[: self.cells.size].reshape(rows, points).argmax(axis=1))

    @cached_property
    def _weights(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Weights of a response at each point in the coefficients, shape (terms, points).

        The second array is the ratio of the sum of squares to the squared coefficient, per term.
        """
        full = np.repeat(self.points, self.capacity.astype(int), axis=0)
        matrix = model_matrix(full, self.publication.terms)
        if np.linalg.matrix_rank(matrix) < len(self.publication.terms):
            raise SpecificationError(
                "model",
                None,
                "has more terms than a central composite design with these rows can tell apart",
            )
        inverse = np.linalg.pinv(matrix)
        last = len(self.points) - 1
        weights = np.zeros((len(inverse), last + 1))
        weights[:, :last] = inverse[:, :last]
        if self.capacity[last]:
            weights[:, last] = inverse[:, last]  # equal for all copies of the centre
        return weights, 1.0 / np.sum(inverse**2, axis=1)

    @cached_property
    def _published(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Matrix, lower bounds and upper bounds of the inequalities for the published numbers.

        The unknowns are the arrangement, rows by points, and one binary number for each sum of
        squares of a term, which is 1 if the coefficient is positive and 0 if it is negative. The
        inequalities are scaled by their width, so that the solver's tolerance is small against it.
        """
        weights, ratios = self._weights
        number = {term: i for i, term in enumerate(self.publication.terms)}
        mean = self.design.responses.mean()
        centred = self.design.responses - mean  # the mean affects only the constant
        sums = [t for t in self.publication.sums_of_squares if not isinstance(t, str)]
        rows, lows, highs = [], [], []
        for term, printed in self.publication.coefficients.items():
            row = np.outer(centred, weights[number[term]]).ravel()
            value = printed.value - (0.0 if any(term) else mean)
            reach = printed.half * (1.0 + SLACK)
            rows.append(np.append(row, np.zeros(len(sums))))
            lows.append(value - reach)
            highs.append(value + reach)
        for index, term in enumerate(sums):
            printed, ratio = self.publication.sums_of_squares[term], ratios[number[term]]
            reach = printed.half * (1.0 + SLACK)
            low = math.sqrt(max(0.0, printed.value - reach) / ratio)
            high = math.sqrt((printed.value + reach) / ratio)
            sign = np.zeros(len(sums))
            sign[index] = -(low + high)  # from low to high if it is 1, from -high to -low if 0
            rows.append(np.append(np.outer(centred, weights[number[term]]).ravel(), sign))
            lows.append(-high)
            highs.append(-low)
        unit = np.maximum(np.subtract(highs, lows), 1e-9)
        matrix = np.reshape(rows, (len(rows), self.cells.size + len(sums)))
        return matrix / unit[:, None], lows / unit, highs / unit
