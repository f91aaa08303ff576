"""A folder of measured data: `dataset.toml`, `specimens.csv`, one CSV file per curve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.measured.tables import need_columns, numbers, read_table, unit_factor
from ramiefenics.specification import (
    BendingTest,
    MeshRecipe,
    SpecificationError,
    mesh_recipe,
    override,
    published_test,
    read_test,
)
from ramiefenics.specification.checks import check_number
from ramiefenics.specification.files import from_dict, read_toml

SPECIMENS = "specimens.csv"
LEAST_ROWS = 20
"""A curve with fewer is not worth a comparison."""


@dataclass(frozen=True)
class Columns:
    """Which column means what.

    Attributes
    ----------
    specimen, curve
        Of `specimens.csv`: name, and path of the curve's file beside `dataset.toml`.
    displacement, force, time
        Of the curves. The time may be missing.
    """

    specimen: str = "specimen"
    curve: str = "curve"
    displacement: str = "displacement_mm"
    force: str = "force_N"
    time: str = "time_s"

    def __post_init__(self) -> None:
        """Check that all are text."""
        for name in ("specimen", "curve", "displacement", "force", "time"):
            _check_text(name, getattr(self, name))


@dataclass(frozen=True)
class Units:
    """Units of the curves' columns, and of the lengths in `specimens.csv`."""

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
    columns, units
        How to read the tables.
    specimens
        From keys of the specification to the columns of `specimens.csv` that have their values, for
        instance ``"stalk.void_diameter_mm" = "void_mm"``; the mean of several if a list.
    fit
        Common factors fitted before anything is suspected, see `ramiefenics.discovery.factors`.
        By default the axial and transverse moduli of every layer.
    mesh
        Recipe of the simulations, by name or in full.
    from_mm, to_mm
        Range of displacement that is compared; all that every curve has by default.
    """

    baseline: str
    title: str = ""
    fixture: dict[str, Any] = field(default_factory=dict)
    speed_mm_per_min: float | None = None
    columns: Columns = field(default_factory=Columns)
    units: Units = field(default_factory=Units)
    specimens: dict[str, Any] = field(default_factory=dict)
    fit: list[str] = field(default_factory=list)
    mesh: MeshRecipe = field(default_factory=lambda: mesh_recipe("screening"))
    from_mm: float = 0.0
    to_mm: float | None = None

    def __post_init__(self) -> None:
        """Check each by itself."""
        _check_text("baseline", self.baseline)
        check_number(self, "from_mm", at_least=0.0, unit="mm")
        for name in ("to_mm", "speed_mm_per_min"):
            if getattr(self, name) is not None:
                check_number(self, name, above=0.0)
        for key, value in self.specimens.items():
            if not _listed(value) or not all(isinstance(v, str) for v in _listed(value)):
                allowed = "must be the name of a column, or a list of some"
                raise SpecificationError(f"specimens.{key}", value, allowed)
        if not isinstance(self.fit, list):
            raise SpecificationError("fit", self.fit, "must be a list of names")


@dataclass(frozen=True)
class Specimen:
    """One stalk, its test as specified and its curve as measured.

    Attributes
    ----------
    name
        Its own.
    test
        The baseline with this specimen's geometry and covariates.
    curve
        ``displacement_mm``, ascending, ``force_N``, and ``time_s`` if known.
    """

    name: str
    test: BendingTest
    curve: pd.DataFrame


@dataclass(frozen=True)
class Dataset:
    """Measured curves that one specification stands for.

    Attributes
    ----------
    folder
        Where it was read.
    layout
        What `dataset.toml` says.
    baseline
        The specification before a specimen's own values.
    specimens
        In the order of `specimens.csv`.
    """

    folder: Path
    layout: Layout
    baseline: BendingTest
    specimens: tuple[Specimen, ...]

    @property
    def range_mm(self) -> tuple[float, float]:
        """Displacements between which the curves are compared."""
        ends = [float(s.curve["displacement_mm"].iloc[-1]) for s in self.specimens]
        return self.layout.from_mm, min(ends) if self.layout.to_mm is None else self.layout.to_mm


def read_dataset(folder: str | Path) -> Dataset:
    """Read and check a folder of measured data.

    Raises
    ------
    SpecificationError
        On the first defect: file, row, and what to do.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise SpecificationError("dataset", str(folder), "must be a folder with a dataset.toml")
    try:
        layout = from_dict(Layout, read_toml(folder / "dataset.toml"))
        baseline = _baseline(folder, layout)
    except SpecificationError as error:
        raise error.inside("dataset.toml") from error
    path = folder / SPECIMENS
    table = read_table(path)
    sources = {key: _listed(value) for key, value in layout.specimens.items()}
    names = layout.columns
    used = [column for columns in sources.values() for column in columns]
    need_columns(path, table, [names.specimen, names.curve, *used])
    values = {column: numbers(path, table, column) for column in used}
    specimens = []
    for index in range(len(table)):
        row = {k: float(np.mean([values[c][index] for c in v])) for k, v in sources.items()}
        specimens.append(_specimen(folder, layout, baseline, table.iloc[index], index + 2, row))
    dataset = Dataset(folder, layout, baseline, tuple(specimens))
    _check_together(dataset, table)
    return dataset


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _check_text(name: str, value: Any) -> None:
    if not isinstance(value, str):
        raise SpecificationError(name, value, "must be text")


def _baseline(folder: Path, layout: Layout) -> BendingTest:
    named = not layout.baseline.endswith(".toml")
    test = published_test(layout.baseline) if named else read_test(folder / layout.baseline)
    return override(test, [f"fixture.{key}={value}" for key, value in layout.fixture.items()])


def _specimen(
    folder: Path,
    layout: Layout,
    baseline: BendingTest,
    row: pd.Series[str],
    number: int,
    values: Mapping[str, float],
) -> Specimen:
    name = row[layout.columns.specimen]
    length = layout.units.factor("specimens")
    changes = [f"{k}={v * (length if k.endswith('_mm') else 1.0)}" for k, v in values.items()]
    try:
        test = override(baseline, changes)
    except SpecificationError as error:
        raise error.inside(f"{SPECIMENS}, row {number} ({name}): ") from error
    return Specimen(name, test, _curve(folder / row[layout.columns.curve], layout))


def _curve(path: Path, layout: Layout) -> pd.DataFrame:
    table = read_table(path)
    columns, units = layout.columns, layout.units
    need_columns(path, table, [columns.displacement, columns.force])
    wanted = {"displacement_mm": "displacement", "force_N": "force"}
    if columns.time in table.columns:
        wanted["time_s"] = "time"
    curve = pd.DataFrame(
        {
            name: np.array(numbers(path, table, getattr(columns, what))) * units.factor(what)
            for name, what in wanted.items()
        }
    )
    if len(curve) < LEAST_ROWS:
        allowed = f"must be at least {LEAST_ROWS} for a curve"
        raise SpecificationError(f"{path.name}, number of rows", len(curve), allowed)
    travel = curve["displacement_mm"].to_numpy()
    back = np.flatnonzero(np.diff(travel) < -0.01 * np.ptp(travel))
    if len(back):
        raise SpecificationError(
            f"{path.name}, row {back[0] + 3}, column {columns.displacement}",
            float(travel[back[0] + 1]),
            "must not go back by more than 1 % of the range; cut the curve before unloading",
        )
    if curve["force_N"].max() <= 0.0:
        allowed = "must be above 0 N somewhere: compression counts positive; turn the sign"
        raise SpecificationError(f"{path.name}, largest force", curve["force_N"].max(), allowed)
    return curve.sort_values("displacement_mm", kind="stable", ignore_index=True)


def _check_together(dataset: Dataset, table: pd.DataFrame) -> None:
    names = table[dataset.layout.columns.specimen]
    for row in np.flatnonzero(names.duplicated()):
        allowed = "must not occur twice; give each specimen a name of its own"
        raise SpecificationError(f"{SPECIMENS}, row {row + 2}, specimen", names.iloc[row], allowed)
    low, high = dataset.range_mm
    if not low < high:
        raise SpecificationError(
            "dataset.toml.to_mm", high, f"must be above from_mm = {low:g}, within every curve"
        )
    for specimen in dataset.specimens:
        end = float(specimen.curve["displacement_mm"].iloc[-1])
        if end < high:
            raise SpecificationError(
                "dataset.toml.to_mm",
                high,
                f"must be at most {end:g} mm, where the curve of {specimen.name} ends; lower it or "
                "take that specimen out",
            )
