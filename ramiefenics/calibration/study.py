"""A study, written as a TOML file: baseline, factors, design, responses and targets."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from ramiefenics.calibration.designs import Design, DesignChoice
from ramiefenics.calibration.desirability import Goal
from ramiefenics.calibration.factors import Array, Factor, Space
from ramiefenics.calibration.misfit import Targets
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.selection import RULES
from ramiefenics.calibration.surface import repeats
from ramiefenics.calibration.terms import MODELS, model_matrix, model_terms
from ramiefenics.measured import Dataset, read_dataset
from ramiefenics.published import published_test
from ramiefenics.specification import (
    BendingTest,
    SpecificationError,
    override,
    read_test,
)
from ramiefenics.specification.checks import check_choice, check_number, check_text
from ramiefenics.specification.files import from_dict
from ramiefenics.specification.reading import read_toml

STUDIES = Path(__file__).resolve().parent / "studies"
"""Folder of the studies that come with the code."""


@dataclass(frozen=True)
class Response:
    """A response, with its measured value if there is one.

    Attributes
    ----------
    name
        Name of the response; see `ramiefenics.calibration.responses.response`.
    target
        Measured value.
    error
        Standard error of the measured value.
    dataset
        Instead of these two, a folder of measured data, relative to that of the study. The target
        is then the mean of its specimens, and the error the standard error of that mean.
    goal
        Goal for the response. All goals of a study are combined into one desirability.
    """

    name: str
    target: float | None = None
    error: float | None = None
    dataset: str | None = None
    goal: Goal | None = None

    def __post_init__(self) -> None:
        """Check that the response exists, and that a target has a standard error."""
        check_text(self, "name")
        response(self.name)
        if self.target is not None and self.dataset is not None:
            allowed = "must be left out if there is a target"
            raise SpecificationError("dataset", self.dataset, allowed)
        if (self.target is None) != (self.error is None):
            allowed = "must be given if and only if there is a target"
            raise SpecificationError("error", self.error, allowed)
        if self.target is not None:
            check_number(self, "target")
            check_number(self, "error", above=0.0)


@dataclass(frozen=True)
class Study:
    """A designed study of the simulator, with a calibration if there are measured values.

    Attributes
    ----------
    baseline
        Name of a published test, or path of a specification relative to `folder`.
    factors
        Numbers of the specification that are varied.
    responses
        Numbers that are computed from the force curves.
    title
        Title, on one line.
    changes
        Changes to the baseline, each of the form ``key=value``.
    mesh
        Name of the mesh recipe of the simulations; by default that of the baseline.
    design
        Design of experiments, which defines the runs.
    model
        Polynomial model of the surfaces, one of `MODELS`; by default linear for a Plackett-Burman
        design, otherwise quadratic.
    selection
        Rule by which terms of the model are kept, one of `RULES`.
    folder
        Folder that paths are relative to.
    """

    baseline: str
    factors: tuple[Factor, ...]
    responses: tuple[Response, ...]
    title: str = ""
    changes: tuple[str, ...] = ()
    mesh: str | None = None
    design: DesignChoice = field(default_factory=DesignChoice)
    model: str | None = None
    selection: str = "p"
    folder: str = "."

    def __post_init__(self) -> None:
        """Check all choices, and that the design can tell the terms of the model apart."""
        for name in ("baseline", "title"):
            check_text(self, name)
        if self.mesh is not None:
            check_text(self, "mesh")
        for change in self.changes:
            if not isinstance(change, str) or "=" not in change:
                raise SpecificationError("changes", change, "must be text of the form key=value")
        for name in ("factors", "responses"):
            if not getattr(self, name):
                raise SpecificationError(name, [], "must have at least one entry")
        if self.model is not None:
            check_choice(self, "model", MODELS)
        check_choice(self, "selection", tuple(RULES))
        names = [wanted.name for wanted in self.responses]
        for name in names:
            if names.count(name) > 1:
                raise SpecificationError("responses", name, "must not occur twice")
        design = self.plan()
        columns = {f"{name}_coded" for name in self.space(design).names}
        taken = columns | {"run", "ending", *names}
        for factor in self.factors:
            if factor.name in taken:
                allowed = f"must not be one of {', '.join(sorted(taken))}"
                raise SpecificationError("factors.name", factor.name, allowed)
        self._check_rank(design)

    def _check_rank(self, design: Design) -> None:
        terms = model_terms(len(self.factors), self.polynomial)
        points = design.coded[[group[0] for group in repeats(design.coded)]]
        if len(points) <= len(terms):
            allowed = f"must be more than the {len(terms)} terms of the {self.polynomial} model"
            raise SpecificationError("distinct runs of the design", len(points), allowed)
        if np.linalg.matrix_rank(model_matrix(points, terms)) < len(terms):
            allowed = "must be one whose terms the design can tell apart, such as 'linear'"
            raise SpecificationError("model", self.polynomial, allowed)

    def plan(self) -> Design:
        """Return the design."""
        return self.design.make(len(self.factors))

    def space(self, design: Design) -> Space:
        """Return the factors with their coding."""
        inside = self.design.ends == "axial" and design.alpha is not None
        return Space(self.factors, design.region.reach if inside else 1.0)

    @property
    def polynomial(self) -> str:
        """Name of the polynomial model of the surfaces."""
        screening = self.design.kind == "plackett_burman"
        return self.model or ("linear" if screening else "quadratic")

    def test(self) -> BendingTest:
        """Return the baseline with the study's mesh and changes applied."""
        named = not self.baseline.endswith(".toml")
        path = Path(self.folder) / self.baseline
        test = published_test(self.baseline) if named else read_test(path)
        mesh = [] if self.mesh is None else [f"numerics.mesh={self.mesh}"]
        return override(test, [*mesh, *self.changes])

    def tests(self) -> list[BendingTest]:
        """Return the specifications of all runs of the design.

        Raises
        ------
        SpecificationError
            If they cannot be made, if a factor is not a number of the baseline, or if a response is
            read beyond its travel.
        """
        baseline, design = self.test(), self.plan()
        for factor in self.factors:
            factor.baseline(baseline)
        for wanted in self.responses:
            response(wanted.name).check_travel(baseline.protocol.travel_mm)
        return self.space(design).tests(baseline, design.coded)

    def targets(self) -> Targets | None:
        """Return the measured values; None if there are none.

        Responses of one data set share their specimens. The covariance of their errors is that of
        the specimens divided by the number of specimens. All other targets are independent.

        Raises
        ------
        SpecificationError
            If a data set cannot be read, has another span than the baseline, several curves per
            specimen or too few specimens, or if one of its curves does not determine a response.
        """
        measured = [w for w in self.responses if w.target is not None or w.dataset is not None]
        if not measured:
            return None
        values, covariance = np.empty(len(measured)), np.zeros((len(measured),) * 2)
        folders = {wanted.dataset for wanted in measured if wanted.dataset is not None}
        for folder in sorted(folders):
            rows = [i for i, wanted in enumerate(measured) if wanted.dataset == folder]
            dataset = read_dataset(Path(self.folder) / folder)
            theirs, own = (
                test.fixture.check_beam("data sets are") for test in (dataset.baseline, self.test())
            )
            for name, span, mine in zip(("span_mm", "inner_span_mm"), theirs, own, strict=True):
                if span != mine:
                    allowed = f"must be that of the study's baseline, {mine:g} mm"
                    raise SpecificationError(f"{folder}: fixture.{name}", span, allowed)
            seen = _observed(dataset, [measured[i] for i in rows])
            values[rows] = seen.mean(axis=0)
            covariance[np.ix_(rows, rows)] = np.atleast_2d(np.cov(seen.T)) / len(seen)
        for i, wanted in enumerate(measured):
            if wanted.target is not None and wanted.error is not None:
                values[i], covariance[i, i] = wanted.target, wanted.error**2
        return Targets(tuple(wanted.name for wanted in measured), values, covariance)


def _observed(dataset: Dataset, wanted: list[Response]) -> Array:
    """Return the responses of all specimens, shape (specimens, responses)."""
    number = len(dataset.specimens)
    if number < len(dataset.records):
        allowed = (
            "must be one per specimen: further curves have different means, and are not independent"
        )
        raise SpecificationError(f"curves in {dataset.folder}", len(dataset.records), allowed)
    if number <= len(wanted):
        allowed = (
            f"must be more than the {len(wanted)} responses read from their curves, so that an "
            "error can be estimated"
        )
        raise SpecificationError(f"specimens in {dataset.folder}", number, allowed)
    seen = np.empty((number, len(wanted)))
    for column, entry in enumerate(wanted):
        found = response(entry.name)
        for row, record in enumerate(dataset.records):
            seen[row, column] = found.of(record.curve)
            if not np.isfinite(seen[row, column]):
                allowed = f"must be a response that can be read from the curve of {record.name}"
                raise SpecificationError("responses", entry.name, allowed)
    return seen


def read_study(study: str | Path) -> Study:
    """Read a study.

    Parameters
    ----------
    study
        A TOML file, or the name of a study that comes with the code: ``table4``, the published one.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or contains an invalid value.
    """
    return read_named(Study, study, STUDIES)


T = TypeVar("T")


def read_named(cls: type[T], study: str | Path, shipped: Path) -> T:
    """Read a study of a given class from a TOML file, or by its name from the folder `shipped`.

    The class must have an attribute `folder`, which is set to the folder of the file.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or contains an invalid value.
    """
    path = Path(study)
    if path.suffix != ".toml":
        names = sorted(found.stem for found in shipped.glob("*.toml"))
        if str(study) not in names:
            allowed = f"must be a TOML file or one of {', '.join(names)}"
            raise SpecificationError("study", str(study), allowed)
        path = shipped / f"{study}.toml"
    data = read_toml(path)
    if "folder" in data:
        allowed = "must be left out: it is the folder of the study's file"
        raise SpecificationError("folder", data["folder"], allowed)
    return from_dict(cls, {**data, "folder": str(path.parent)})
