"""What a validation is: observed stalks, uncertain factors with their ranges, splits; as TOML."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ramiefenics.calibration.designs import DesignChoice
from ramiefenics.calibration.factors import Factor
from ramiefenics.calibration.study import Response, Study, read_named
from ramiefenics.specification import SpecificationError
from ramiefenics.specification.checks import check_number, check_text

STUDIES = Path(__file__).resolve().parent / "studies"
"""Files of the validations that can be named."""


@dataclass(frozen=True)
class Observation:
    """A stalk, or the mean of several, that was bent.

    Attributes
    ----------
    name
        In tables and in splits.
    baseline
        A published test, or a specification beside the study.
    measured, error
        Measured value of the response, and its standard error as a measurement of what the
        specification describes: for one stalk, how far stalks scatter.
    dataset
        In their place, a folder of measured data beside the study: the mean of its specimens.
    published
        What another simulation gave, to compare with.
    """

    name: str
    baseline: str
    measured: float | None = None
    error: float | None = None
    dataset: str | None = None
    published: float | None = None

    def __post_init__(self) -> None:
        """Check that something was measured."""
        check_text(self, "name", empty=False)
        for name in ("measured", "error"):
            if getattr(self, name) is not None:
                check_number(self, name, above=0.0 if name == "error" else None)
        if self.measured is None and self.dataset is None:
            raise SpecificationError("measured", None, "must be given, or a dataset in its place")
        if self.published is not None:
            check_number(self, "published")


@dataclass(frozen=True)
class Split:
    """Which observations the factors are calibrated on, and which they then predict.

    Attributes
    ----------
    title
        A few words.
    on, predict
        Names of observations; by default all others are predicted.
    """

    title: str
    on: tuple[str, ...]
    predict: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check that nothing predicts itself, or is calibrated on twice."""
        check_text(self, "title", empty=False)
        if not self.on:
            raise SpecificationError("on", [], "must name at least one observation")
        for name in self.on:
            if self.on.count(name) > 1:
                raise SpecificationError("on", name, "must not occur twice")
        for name in self.on:
            if name in self.predict:
                raise SpecificationError("predict", name, "must not be calibrated on too")


@dataclass(frozen=True)
class ValidationStudy:
    """A validation.

    Attributes
    ----------
    factors
        What is not known: numbers of the specification, each with a prior that is flat between its
        ends on its scale.
    observations
        What was measured.
    splits
        Each a calibration with its predictions.
    nuisance
        Names of factors that nobody would calibrate, but nobody has measured either.
    response
        The number that is compared, as `ramiefenics.calibration.responses.response` knows it.
    title
        One line.
    changes
        Of all baselines, each ``key=value``.
    mesh
        Recipe of the simulations.
    design, model, selection
        Runs per observation, and the response surfaces through them, as in `Study`.
    folder
        What paths are relative to.
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
        """Check that names are known and differ."""
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
                allowed = "must not have two observations of one data set, which share specimens"
                raise SpecificationError("splits.on", list(split.on), allowed)
        for name in self.nuisance:
            _check_known("nuisance", name, [factor.name for factor in self.factors])
        for observation in self.observations:
            self.of(observation)

    def of(self, observation: Observation) -> Study:
        """Return the designed study of one observation, with its target."""
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
        """Return the names of what a split predicts, in the order of the observations."""
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
        A TOML file, or the name of one that comes with the code: ``published``.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or states something that cannot be.
    """
    return read_named(ValidationStudy, study, STUDIES)
