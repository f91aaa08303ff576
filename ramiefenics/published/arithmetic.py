"""Arithmetic checks of the study: printed numbers, recomputed from others by its formulas."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ramiefenics.published.rounding import Printed, recompute
from ramiefenics.published.tables import printed_table, printed_values, published_table

AXIAL = 1.682
"""Coded level of the axial points in Tables 4 and 5."""


@dataclass(frozen=True)
class Check:
    """A printed number, and its value recomputed from other numbers.

    Parameters
    ----------
    where
        Table or equation that contains the number.
    what
        Quantity, with its unit.
    printed
        Number as printed.
    recomputed, low, high
        Recomputed value, and its range over all inputs that round to the printed ones.
    formula
        Formula of the recomputation, in words.
    """

    where: str
    what: str
    printed: Printed
    recomputed: float
    low: float
    high: float
    formula: str

    @property
    def holds(self) -> bool:
        """Whether the printed number agrees with the formula within rounding."""
        return self.printed.agrees(self.low, self.high)


def published_checks() -> list[Check]:
    """Return the arithmetic checks of the equations, of Tables 1 to 4, 7 and 8, and of the text.

    Table 5 is checked by `ramiefenics.reconciliation.reconcile`, Table 6 by `check_anova`.
    """
    values = printed_values()
    return [
        *_of_equations(values),
        *_of_positions(values),
        *_of_table_3(values),
        *_of_coding(),
        *_of_calibration(values),
        *_of_table_8(values),
    ]


def phloem_share(outer: float, inner: float, phloem: float) -> float:
    """Return the phloem's share of the section by the study's Eq. 3; lengths in one unit."""
    return (4.0 * outer * phloem - 4.0 * phloem**2) / (outer**2 - inner**2)


def _check(
    where: str,
    what: str,
    printed: Printed,
    formula: str,
    function: Callable[..., float],
    *inputs: Printed,
) -> Check:
    return Check(where, what, printed, *recompute(function, *inputs), formula)


def _of_equations(values: dict[str, Printed]) -> Iterator[Check]:
    constant = values["eq2_constant"]
    yield _check("Eq. 2", "constant", constant, "2 / (pi / 4)", lambda: 8.0 / math.pi)


def _of_positions(values: dict[str, Printed]) -> Iterator[Check]:
    for cell in printed_table(2)["loading_position_cm"]:
        ends = (Printed(values[f"sample_{cell}cm_{end}_cm"].value) for end in ("from", "to"))
        yield _check(
            "Table 2",
            f"loading position {cell} cm (cm)",
            Printed(float(cell)),
            "middle of the sampled range in the text",
            lambda start, end: (start + end) / 2.0,
            *ends,
        )


def _of_table_3(values: dict[str, Printed]) -> Iterator[Check]:
    outer, wood = values["stalk_diameter_mm"], values["xylem_outer_diameter_mm"]
    inner, thickness = values["xylem_inner_diameter_mm"], values["phloem_thickness_mm"]
    yield _check(
        "Table 3",
        "phloem thickness (mm)",
        thickness,
        "half of stalk diameter less xylem outer diameter",
        lambda a, b: (a - b) / 2.0,
        outer,
        wood,
    )
    for layer in ("xylem", "phloem"):
        least, most = (values[f"{layer}_nu_XY_{end}"].value for end in ("min", "max"))
        yield _check(
            "Table 3",
            f"{layer} G_XY (MPa)",
            values[f"{layer}_G_XY_MPa"],
            f"Eq. 4: E_X / (2 (1 + mu_XY)), mu_XY {least:g} to {most:g}",
            lambda modulus, ratio: modulus / (2.0 * (1.0 + ratio)),
            values[f"{layer}_E_X_MPa"],
            Printed((least + most) / 2.0, (most - least) / 2.0),
        )
    yield _check(
        "Table 1",
        "fresh cortex to stalk ratio (%)",
        values["cortex_ratio_percent"],
        "Eq. 3 with the dimensions of Table 3",
        lambda *lengths: 100.0 * phloem_share(*lengths),
        outer,
        inner,
        thickness,
    )
    yield _check(
        "Table 1",
        "average density of the main stalk (g/cm3)",
        values["mean_density_g_per_cm3"],
        "densities of Table 3, shares by Eq. 3",
        lambda a, b, c, phloem, xylem: xylem + phloem_share(a, b, c) * (phloem - xylem),
        outer,
        inner,
        thickness,
        values["phloem_density_g_per_cm3"],
        values["xylem_density_g_per_cm3"],
    )


def _coding() -> dict[str, tuple[float, float]]:
    """Return the centre and the size of one coded unit of each factor, from Table 4's axial levels.

    Both are in natural units.
    """
    rows = {row.pop("factor_level"): row for row in published_table(4).to_dict("records")}
    low, high = rows[-AXIAL], rows[AXIAL]
    return {
        str(name): ((low[name] + high[name]) / 2.0, (high[name] - low[name]) / 2.0 / AXIAL)
        for name in low
    }


def _of_coding() -> Iterator[Check]:
    for row in printed_table(4).to_dict("records"):
        level = float(row["factor_level"])
        for name, (centre, unit) in _coding().items():
            if abs(level) != AXIAL:
                yield _check(
                    "Table 4",
                    f"{name} at level {level:g}",
                    Printed.read(row[name]),
                    f"linear between the levels -{AXIAL} and {AXIAL}",
                    lambda value=centre + level * unit: value,
                )


def _of_calibration(values: dict[str, Printed]) -> Iterator[Check]:
    anova = printed_table(6).set_index("source")["sum_of_squares_N2"]
    yield _check(
        "text",
        "coefficient of determination",
        values["coefficient_of_determination"],
        "sums of squares of Table 6, model over total",
        lambda model, total: model / total,
        Printed.read(anova["Model"]),
        Printed.read(anova["Core total"]),
    )
    yield _check(
        "text",
        "mean maximum force at 69 cm (N), the target if there was one",
        values["max_force_69cm_N"],
        "Eq. 5 at the parameters of Table 7, coded by Table 4",
        _equation_5,
        *(values[f"eq5_{name}_N"] for name in ("intercept", "X2", "X3", "X1X2", "X2X3")),
        *(values[name] for name in ("dynamic_friction", "phloem_nu_XY", "xylem_nu_XY")),
    )


def _equation_5(b0: float, b2: float, b3: float, b12: float, b23: float, *natural: float) -> float:
    """Return the force (N) of Eq. 5; friction coefficient and Poisson's ratios in natural units."""
    x1, x2, x3 = (
        (value - centre) / unit
        for value, (centre, unit) in zip(natural, _coding().values(), strict=True)
    )
    return b0 + b2 * x2 + b3 * x3 + b12 * x1 * x2 + b23 * x2 * x3


def _of_table_8(values: dict[str, Printed]) -> Iterator[Check]:
    for number, row in enumerate(printed_table(8).to_dict("records"), start=1):
        printed = {str(name): Printed.read(cell) for name, cell in row.items()}
        yield _check(
            "Table 8",
            f"error of stalk {number} (%)",
            printed["error_percent"],
            "simulated over measured force, less 1",
            lambda measured, simulated: 100.0 * (simulated / measured - 1.0),
            printed["measured_force_N"],
            printed["simulated_force_N"],
        )
        yield _check(
            "Table 1",
            f"fresh cortex to stalk ratio (%), stalk {number} of Table 8",
            values["cortex_ratio_percent"],
            "Eq. 3 with the dimensions of Table 8",
            lambda *lengths: 100.0 * phloem_share(*lengths),
            *(printed[f"{name}_mm"] for name in ("outer_diameter", "inner_diameter")),
            printed["phloem_thickness_mm"],
        )
