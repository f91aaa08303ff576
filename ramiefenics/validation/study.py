"""A validation, written as a TOML file: observed stalks, uncertain factors, and splits."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ramiefenics.calibration.designs import DesignChoice
from ramiefenics.calibration.factors import Factor
from ramiefenics.calibration.study import Response, Study, read_named
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.checks import check_number, check_text

STUDIES = Path(__file__).resolve().parent / "studies"
"""Folder of the validations that come with the code."""


@dataclass(frozen=True)
class Observation:
    """Measurement of a stalk, or of the mean of several stalks.

    Attributes
    ----------
    name
        Name in tables and in splits.
    baseline
        Name of a published test, or path of a specification relative to the study's folder.
    measured
        Measured value of the response.
    error
        Standard error of that value as a measurement of what the specification describes; for a
        single stalk, the standard deviation between stalks.
    dataset
        Instead of these two, a folder of measured data, relative to that of the study; its mean
        over the specimens is used.
    published
        Result of another simulation, for comparison.
    """

    name: str
    baseline: str
    measured: float | None = None
    error: float | None = None
    dataset: str | None = None
    published: float | None = None

    def __post_init__(self) -> None:
        """Check that there is a measured value, and that all numbers are valid."""
        check_text(self, "name", empty=False)
        for name in ("measured", "error"):
            if getattr(self, name) is not None:
                check_number(self, name, above=0.0 if name == "error" else None)
        if self.measured is None and self.dataset is None:
            raise SpecificationError("measured", None, "must be given if there is no dataset")
        if self.published is not None:
            check_number(self, "published")


@dataclass(frozen=True)
class Split:
    """Observations on which the factors are calibrated, and observations to be predicted.

    Attributes
    ----------
    title
        Short title.
    on
        Names of the observations on which the factors are calibrated.
    predict
        Names of the observations that are predicted; by default all those that are not in `on`.
    """

    title: str
    on: tuple[str, ...]
    predict: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check that no observation is calibrated on twice, or predicted from itself."""
        check_text(self, "title", empty=False)
        if not self.on:
            raise SpecificationError("on", [], "must name at least one observation")
        for name in self.on:
            if self.on.count(name) > 1:
                raise SpecificationError("on", name, "must not occur twice")
        for name in self.on:
            if name in self.predict:
                raise SpecificationError("predict", name, "must not also be calibrated on")


@dataclass(frozen=True)
class ValidationStudy:
    """Study that calibrates on some observations and predicts others.

    Attributes
    ----------
    factors
        Uncertain numbers of the specification, each with a prior that is flat between the ends of
        its range on its scale.
    observations
        Measurements.
    splits
        Divisions of the observations into those calibrated on and those predicted.
    nuisance
        Names of factors that are uncertain but would not normally be calibrated.
    response
        Name of the response that is compared; see `ramiefenics.calibration.responses.response`.
    title
        Title, on one line.
    changes
        Changes to all baselines, each of the form ``key=value``.
    mesh
        Name of the mesh recipe of the simulations; by default that of each baseline.
    design
        Design that is run for each observation, as in `Study`.
    model
        Model of the response surfaces, as in `Study`.
    selection
        Rule by which terms of the response surfaces are selected, as in `Study`.
    folder
        Folder that paths are relative to.
    """

    factors: tuple[Factor, ...]
    observations: tuple[Observation, ...]
    splits: tuple[Split, ...]
    nuisance: tuple[str, ...] = ()
    response: str = "max_force_N"
    title: str = ""
    changes: tuple[str, ...] = ()
    mesh: str | None = None
    design: DesignChoice = field(default_factory=DesignChoice)
    model: str | None = None
    selection: str = "p"
    folder: str = "."

    def __post_init__(self) -> None:
        """Check that all names are known and distinct, and that each observation is usable."""
        for name in ("observations", "splits"):
            if not getattr(self, name):
                raise SpecificationError(name, [], "must have at least one entry")
        titles = [split.title for split in self.splits]
        for title in titles:
            if titles.count(title) > 1:
                raise SpecificationError("splits.title", title, "must not occur twice")
        names = [observation.name for observation in self.observations]
        for name in names:
            if names.count(name) > 1:
                raise SpecificationError("observations", name, "must not occur twice")
        for split in self.splits:
            for name in (*split.on, *split.predict):
                _check_known("splits", name, names)
            sources = [o.dataset for o in self.observations if o.name in split.on and o.dataset]
            if len(set(sources)) < len(sources):
                allowed = "must not have two observations of one data set, as they share specimens"
                raise SpecificationError("splits.on", list(split.on), allowed)
        for name in self.nuisance:
            _check_known("nuisance", name, [factor.name for factor in self.factors])
        for observation in self.observations:
            self.of(observation)

    def of(self, observation: Observation) -> Study:
        """Return the designed study of one observation, with its measured value as the target."""
        wanted = Response(
            self.response, observation.measured, observation.error, observation.dataset
        )
        return Study(
            observation.baseline,
            self.factors,
            (wanted,),
            title=observation.name,
            changes=self.changes,
            mesh=self.mesh,
            design=self.design,
            model=self.model,
            selection=self.selection,
            folder=self.folder,
        )

    def predicted(self, split: Split) -> tuple[str, ...]:
        """Return the names of the observations that a split predicts, in the study's order."""
        wanted = split.predict or [o.name for o in self.observations if o.name not in split.on]
        return tuple(o.name for o in self.observations if o.name in wanted)


def _check_known(where: str, name: str, known: list[str]) -> None:
    if name not in known:
        raise SpecificationError(where, name, f"must be one of {', '.join(map(repr, known))}")


def read_validation(study: str | Path) -> ValidationStudy:
    """Read a validation.

    Parameters
    ----------
    study
        A TOML file, or the name of a validation that comes with the code: ``published``.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or contains an invalid value.
    """
    return read_named(ValidationStudy, study, STUDIES)
