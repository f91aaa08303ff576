"""What `dataset.toml` may say."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ramiefenics.measured.seating import Seating
from ramiefenics.measured.tables import unit_factor
from ramiefenics.specification import MeshRecipe, SpecificationError, Target, mesh_recipe
from ramiefenics.specification.checks import check_number, check_text


@dataclass(frozen=True)
class Columns:
    """Which column means what.

    Attributes
    ----------
    specimen, curve
        Of `specimens.csv`: name, and path of the curve's file beside `dataset.toml`; where
        specimens are tested several times, of `tests.csv`.
    test
        Of `tests.csv`: what the test is called. It may be missing.
    displacement, force, time
        Of the curves. The time may be missing.
    """

    specimen: str = "specimen"
    curve: str = "curve"
    test: str = "test"
    displacement: str = "displacement_mm"
    force: str = "force_N"
    time: str = "time_s"

    def __post_init__(self) -> None:
        """Check that all are text, and that no column means two things."""
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
    """Units of the curves' columns, and of the lengths in `specimens.csv` and `tests.csv`."""

    displacement: str = "mm"
    force: str = "N"
    time: str = "s"
    specimens: str = "mm"

    def __post_init__(self) -> None:
        """Check that all are known."""
        for name in ("displacement", "force", "time", "specimens"):
            self.factor(name)

    def factor(self, name: str) -> float:
        """Return what one of a unit is worth in mm, N or s."""
        inside = {"force": "N", "time": "s"}.get(name, "mm")
        return unit_factor(name, getattr(self, name), inside)


@dataclass(frozen=True)
class Layout:
    """What `dataset.toml` may say.

    Attributes
    ----------
    title
        One line.
    baseline
        A published test, or a specification beside `dataset.toml`.
    fixture
        Changes of the baseline's fixture: ``span_mm``, ``indenter_radius_mm``, ...
    speed_mm_per_min
        Of the crosshead; for the record.
    format
        Of the raw files that the curves were read from; for the record.
    columns, units
        How to read the tables.
    seating
        Where displacement begins; by default where the machine says.
    specimens
        From keys of the specification to the columns of `specimens.csv` that have their values, for
        instance ``"stalk.void_diameter_mm" = "void_mm"``; the mean of several if a list.
    tests
        The same for the columns of `tests.csv`: ``"fixture.span_mm" = "span_mm"``. A test's own
        value comes before its specimen's.
    then
        What follows the first loading in every record, unloading or holds; as `Protocol.then`.
    fit
        Common factors fitted before anything is suspected, see `ramiefenics.discovery.factors`.
        By default the axial and transverse moduli of every layer.
    fit_sd
        How well these are known, standard deviation of their logarithms: 0.1 where the batch's
        moduli were measured to 10 %. The more uncertain they are, the more of an effect they can
        take up.
    mesh
        Recipe of the simulations, by name or in full.
    from_mm, to_mm
        Range of displacement that is compared; by default from 0 to where each curve ends.
        Every curve has to begin before the first displacement that is compared.
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
        """Check each by itself."""
        check_text(self, "baseline")
        check_number(self, "from_mm", at_least=0.0, unit="mm")
        check_number(self, "fit_sd", above=0.0)
        for name in ("to_mm", "speed_mm_per_min"):
            if getattr(self, name) is not None:
                check_number(self, name, above=0.0)
        for table in ("specimens", "tests"):
            for key, value in getattr(self, table).items():
                if not listed(value) or not all(isinstance(v, str) for v in listed(value)):
                    allowed = "must be the name of a column, or a list of some"
                    raise SpecificationError(f"{table}.{key}", value, allowed)


def listed(value: Any) -> list[Any]:
    """Return a list as it is, anything else as the only entry of one."""
    return value if isinstance(value, list) else [value]
