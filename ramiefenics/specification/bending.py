"""The immutable specification of one test, from which all results are computed."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from typing import Any

from ramiefenics.specification.checks import check_instance, check_text
from ramiefenics.specification.cylinder import Cylinder
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.fixture import Fixture
from ramiefenics.specification.general_fixture import GeneralFixture
from ramiefenics.specification.machine import Machine
from ramiefenics.specification.numerics import DOMAINS, Numerics
from ramiefenics.specification.protocol import Protocol
from ramiefenics.specification.stalk import Stalk

LEAST_STEP, LEAST_CUT_STEP = 1e-4, 1e-7
"""Lower bounds of ``max_step_mm`` and ``min_step_mm``, as shares of the path."""

SHARPEST = 1e-3
"""Least ratio of a cylinder's radius to the stalk's diameter."""


@dataclass(frozen=True)
class BendingTest:
    """A test of a stalk: three-point bending by default, or whatever its fixture makes of it.

    Attributes
    ----------
    stalk
        Specimen.
    fixture
        Cylinders and plates that load the specimen, and their friction.
    machine
        Testing machine, which records displacement and force; it does not affect the stalk.
    protocol
        Path of the indenter.
    law
        Material law of all layers: the name of one in `ramiefenics.model.laws`, for instance
        ``saturating_fibre`` (stable under crushing and fibre compression), or the path of a Python
        file that defines one, relative to the current folder.
    numerics
        Mesh and settings of the solver.
    further
        Later tests of the same stalk, one after the other; the stalk keeps the effects of the
        earlier ones. Each states its changes to this test's ``fixture``, ``protocol``, ``machine``
        and ``stalk.rotation_deg``. All tests but the last go back to zero travel.
    group
        Group to which the test belongs, one word, for instance the machine or the harvest. It
        changes nothing, but an effect may be present in one group only.
    """

    stalk: Stalk
    fixture: Fixture | GeneralFixture = field(default_factory=Fixture)
    machine: Machine = field(default_factory=Machine)
    protocol: Protocol = field(default_factory=Protocol)
    law: str = "saturating_fibre"
    numerics: Numerics = field(default_factory=Numerics)
    further: tuple[dict[str, Any], ...] = field(default=(), hash=False)
    group: str = ""

    def __post_init__(self) -> None:
        """Check the parts against each other; for instance, the stalk must reach its supports."""
        for name, cls in (
            ("stalk", Stalk),
            ("machine", Machine),
            ("protocol", Protocol),
            ("numerics", Numerics),
        ):
            check_instance(self, name, cls)
        if not isinstance(self.fixture, GeneralFixture):
            check_instance(self, "fixture", Fixture)
        check_text(self, "law", empty=False)
        check_text(self, "group")
        if not re.fullmatch(r"\w*", self.group):
            allowed = "must be one word of letters, digits and underscores"
            raise SpecificationError("group", self.group, allowed)
        try:
            self.fixture.check_length(self.stalk.length_mm)
        except SpecificationError as error:
            raise error.inside("fixture") from error
        self._check_symmetry()
        self._check_radii()
        self._check_held()
        self._check_steps()
        self._check_bow()
        if self.further:
            for number, test in enumerate(self.tests[:-1]):
                _check_unloaded(test.protocol, f"further.{number - 1}." if number else "")

    @property
    def alone(self) -> BendingTest:
        """The test without the further ones."""
        return replace(self, further=()) if self.further else self

    @property
    def tests(self) -> tuple[BendingTest, ...]:
        """All tests of the stalk, each a complete specification.

        Raises
        ------
        SpecificationError
            If one of the further tests is not valid.
        """
        from ramiefenics.specification.files import merged  # here, as it imports this module

        tests = [self.alone]
        for number, changes in enumerate(self.further):
            try:
                _check_changes(changes)
                tests.append(merged(self.alone, changes))
            except SpecificationError as error:
                raise error.inside(f"further.{number}") from error
        return tuple(tests)

    def front_mm(self, cylinder: Cylinder) -> float:
        """Return the Y of a cylinder's lowest point (highest, if it is below) at first touch, mm.

        A bowed stalk is touched beside that point, where its normal passes through the axis of the
        cylinder.
        """
        top = cylinder.up * self.stalk.top_mm * self.stalk.scale_at(cylinder.z_mm)
        if self.stalk.curvature_per_m == 0.0:
            return top
        bow, away = self.stalk.curvature_per_m / 1000.0, top + cylinder.up * cylinder.radius_mm
        sine = bow * cylinder.z_mm / (1.0 + bow * away)  # of the stalk's slope there
        cosine = math.sqrt(1.0 - sine**2)
        drop = cylinder.z_mm * sine / (1.0 + bow * away) / (1.0 + cosine)
        return away * cosine - drop - cylinder.up * cylinder.radius_mm

    def _check_radii(self) -> None:
        """Check that no cylinder is a blade, which would need an endless number of cells."""
        least = SHARPEST * self.stalk.outer_diameter_mm
        for cylinder in self.fixture.cylinders:
            if cylinder.radius_mm < least:
                allowed = f"must be at least {least:.3g} mm, a thousandth of the stalk's diameter"
                name = f"fixture, radius of the {cylinder.name}"
                raise SpecificationError(name, cylinder.radius_mm, allowed)

    def _check_held(self) -> None:
        """Check that something keeps the stalk from sliding away along its axis.

        A taper or different radii push it only slightly, so that it finds an equilibrium nearby.
        """
        static = self.fixture.friction.static
        if self.fixture.off_centre and static == 0.0:
            allowed = "must be above 0: nothing else keeps a stalk pressed off centre from sliding"
            raise SpecificationError("fixture.friction.static", static, allowed)

    def _check_steps(self) -> None:
        """Check that steps are not so short that a run would hardly ever end."""
        length, stepping = self.protocol.length_mm, self.numerics.stepping
        for name, share in (("max_step_mm", LEAST_STEP), ("min_step_mm", LEAST_CUT_STEP)):
            step, least = getattr(stepping, name), share * length
            if step < least:
                allowed = f"must be at least {least:.3g} mm for a path of {length:g} mm"
                raise SpecificationError(f"numerics.stepping.{name}", step, allowed)

    def _check_bow(self) -> None:
        """Check that each cylinder touches a bowed stalk at one place only."""
        curvature = self.stalk.curvature_per_m
        if curvature == 0.0:
            return
        farthest = max(cylinder.radius_mm for cylinder in self.fixture.cylinders)
        limit = 500.0 / (self.stalk.top_mm + farthest)
        if abs(curvature) > limit:
            allowed = (
                f"must be at most {limit:.3g} 1/m in magnitude, or 0 between plates: a cylinder of "
            )
            allowed += f"radius {farthest:g} mm would touch the stalk in several places"
            raise SpecificationError("stalk.curvature_per_m", curvature, allowed)

    @property
    def least_domain(self) -> tuple[str, str]:
        """The smallest domain that symmetry allows, and what rules out a smaller one."""
        for name, value in (
            ("rotation_deg", self.stalk.rotation_deg),
            ("tissue.fibre_angle_deg", self.stalk.tissue.fibre_angle_deg),
        ):
            if value != 0.0:
                return "full", f"stalk with {name}, which has no symmetry along X"
        for what, skew in (
            ("stalk with taper", self.stalk.taper != 0.0),
            ("stalk with a node off midspan", self.stalk.node_mm and self.stalk.node_at_mm != 0.0),
            ("fixture that differs at Z and -Z", not self.fixture.symmetric),
        ):
            if skew:
                return "half", f"{what}, which has no symmetry along Z"
        return "quarter", ""

    def _check_symmetry(self) -> None:
        """Check that the part that is not modelled is the mirror image of the part that is."""
        domain, (least, what) = self.numerics.domain, self.least_domain
        if DOMAINS.index(domain) < DOMAINS.index(least):
            sufficient = " or ".join(DOMAINS[DOMAINS.index(least) :])
            allowed = f"must be {sufficient} for a {what}"
            raise SpecificationError("numerics.domain", domain, allowed)


CHANGED = ("fixture", "protocol", "machine", "stalk")
"""Tables that further tests may change; of the stalk, only its rotation."""


def _check_changes(changes: dict[str, Any]) -> None:
    """Check that a further test is a test of the same stalk."""
    for name in changes:
        if name not in CHANGED:
            raise SpecificationError(name, changes[name], f"must be one of {', '.join(CHANGED)}")
    stalk = changes.get("stalk", {})
    if not isinstance(stalk, dict) or set(stalk) - {"rotation_deg"}:
        allowed = "must be that of the first test: only rotation_deg may change"
        raise SpecificationError("stalk", stalk, allowed)


def _check_unloaded(protocol: Protocol, place: str) -> None:
    """Check that a path ends at zero travel, as another test follows it."""
    if protocol.legs[-1].to_mm != 0.0:
        allowed = "must be 0 at the end of the path if another test of the stalk follows: "
        allowed += "protocol.then = [{ to_mm = 0 }]"
        raise SpecificationError(f"{place}protocol.then", protocol.legs[-1].to_mm, allowed)
