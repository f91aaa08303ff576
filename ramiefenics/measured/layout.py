"""Contents of `dataset.toml`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ramiefenics.measured.seating import Seating
from ramiefenics.measured.tables import unit_factor
from ramiefenics.specification import MeshRecipe, SpecificationError, Target, mesh_recipe
from ramiefenics.specification.checks import check_number, check_text


@dataclass(frozen=True)
class Columns:
    """Names of the columns of the tables.

    Attributes
    ----------
    specimen
        Name of the specimen, in `specimens.csv`, and in `tests.csv` if there is one.
    curve
        Path of the curve's file, relative to the folder of `dataset.toml`: in `tests.csv` if there
        is one, else in `specimens.csv`.
    test
        Name of the test, in `tests.csv`. The column may be missing.
    displacement
        Column of the displacement, in the curves.
    force
        Column of the force, in the curves.
    time
        Column of the time, in the curves; it may be missing.
    """

    specimen: str = "specimen"
    curve: str = "curve"
    test: str = "test"
    displacement: str = "displacement_mm"
    force: str = "force_N"
    time: str = "time_s"

    def __post_init__(self) -> None:
        """Check that all are text, and that no column has two meanings."""
        for table in (("specimen", "curve", "test"), ("displacement", "force", "time")):
            taken: set[str] = set()
            for name in table:
                check_text(self, name, empty=False)
                if getattr(self, name) in taken:
                    allowed = "must be a column of its own"
                    raise SpecificationError(name, getattr(self, name), allowed)
                taken.add(getattr(self, name))


@dataclass(frozen=True)
class Units:
    """Units of the curves' columns, and of the lengths in `specimens.csv` and `tests.csv`.

    Attributes
    ----------
    displacement
        Unit of the displacement.
    force
        Unit of the force.
    time
        Unit of the time.
    specimens
        Unit of the lengths in `specimens.csv` and `tests.csv`.
    """

    displacement: str = "mm"
    force: str = "N"
    time: str = "s"
    specimens: str = "mm"

    def __post_init__(self) -> None:
        """Check that all units are known."""
        for name in ("displacement", "force", "time", "specimens"):
            self.factor(name)

    def factor(self, name: str) -> float:
        """Return the value of a unit in mm, N or s."""
        inside = {"force": "N", "time": "s"}.get(name, "mm")
        return unit_factor(name, getattr(self, name), inside)


@dataclass(frozen=True)
class Layout:
    """Contents of `dataset.toml`.

    Attributes
    ----------
    title
        Title, one line.
    baseline
        Name of a published test, or a specification file beside `dataset.toml`.
    fixture
        Changes to the baseline's fixture: ``span_mm``, ``indenter_radius_mm``, ...
    speed_mm_per_min
        Speed of the crosshead, for the record.
    format
        Format of the raw files from which the curves were read, for the record.
    columns
        Names of the columns of the tables.
    units
        Units of the columns of the tables.
    seating
        Where displacement begins; by default at the zero of the machine.
    specimens
        Columns of `specimens.csv` by the keys of the specification whose values they hold, for
        instance ``"stalk.void_diameter_mm" = "void_mm"``; of a list of columns, the mean is taken.
    tests
        The same for the columns of `tests.csv`: ``"fixture.span_mm" = "span_mm"``. A value of the
        test takes precedence over that of its specimen.
    then
        What follows the first loading in every record, unloading or holds; as `Protocol.then`.
    fit
        Common factors that are fitted before any effect is suspected, see
        `ramiefenics.discovery.curves.factors`. By default the axial and transverse moduli of every
        layer.
    fit_sd
        Uncertainty of these factors, as the standard deviation of their logarithms: 0.1 if the
        moduli of the batch were measured to 10 %. The more uncertain they are, the more of an
        effect they can take up.
    mesh
        Mesh recipe of the simulations, by name or in full.
    from_mm
        First displacement that is compared. Every curve must begin before it.
    to_mm
        Last displacement that is compared; by default the end of each curve.
    """

    baseline: str
    title: str = ""
    fixture: dict[str, Any] = field(default_factory=dict)
    speed_mm_per_min: float | None = None
    format: str = ""
    columns: Columns = field(default_factory=Columns)
    units: Units = field(default_factory=Units)
    seating: Seating = field(default_factory=Seating)
    specimens: dict[str, Any] = field(default_factory=dict)
    tests: dict[str, Any] = field(default_factory=dict)
    then: tuple[Target, ...] = ()
    fit: list[str] = field(default_factory=list)
    fit_sd: float = 0.3
    mesh: MeshRecipe = field(default_factory=lambda: mesh_recipe("screening"))
    from_mm: float = 0.0
    to_mm: float | None = None

    def __post_init__(self) -> None:
        """Check each value by itself."""
        check_text(self, "baseline")
        check_number(self, "from_mm", at_least=0.0, unit="mm")
        check_number(self, "fit_sd", above=0.0)
        for name in ("to_mm", "speed_mm_per_min"):
            if getattr(self, name) is not None:
                check_number(self, name, above=0.0)
        for table in ("specimens", "tests"):
            for key, value in getattr(self, table).items():
                if not listed(value) or not all(isinstance(v, str) for v in listed(value)):
                    allowed = "must be the name of a column, or a list of names"
                    raise SpecificationError(f"{table}.{key}", value, allowed)


def listed(value: Any) -> list[Any]:
    """Return a list as it is, and anything else as the only entry of a list."""
    return value if isinstance(value, list) else [value]
