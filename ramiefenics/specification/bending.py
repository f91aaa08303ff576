"""One test: the immutable specification that everything else maps to results."""

from __future__ import annotations

from dataclasses import dataclass, field

from ramiefenics.specification.checks import check_instance, check_text
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.fixture import Fixture, Machine, Protocol
from ramiefenics.specification.numerics import Numerics
from ramiefenics.specification.stalk import Stalk


@dataclass(frozen=True)
class BendingTest:
    """A three-point bending test.

    Attributes
    ----------
    stalk
        What is bent.
    fixture
        What bends it.
    machine
        What adds to the displacement that is measured; the stalk does not feel it.
    protocol
        How far.
    law
        Material law of all layers: the name of one in `ramiefenics.model.laws`, for instance
        ``saturating_fibre`` (stable under crushing and fibre compression), or the path of a Python
        file that defines one, seen from the current folder.
    numerics
        How it is solved.
    """

    stalk: Stalk
    fixture: Fixture = field(default_factory=Fixture)
    machine: Machine = field(default_factory=Machine)
    protocol: Protocol = field(default_factory=Protocol)
    law: str = "saturating_fibre"
    numerics: Numerics = field(default_factory=Numerics)

    def __post_init__(self) -> None:
        """Check what concerns two parts at once: the stalk must lie on its supports."""
        for name, cls in (
            ("stalk", Stalk),
            ("fixture", Fixture),
            ("machine", Machine),
            ("protocol", Protocol),
            ("numerics", Numerics),
        ):
            check_instance(self, name, cls)
        check_text(self, "law", empty=False)
        span, length = self.fixture.span_mm, self.stalk.length_mm
        if span >= length:
            raise SpecificationError(
                "fixture.span_mm", span, f"must be below the specimen's length {length:g} mm"
            )
        if self.stalk.taper != 0.0 and self.numerics.domain == "quarter":
            raise SpecificationError(
                "numerics.domain",
                "quarter",
                "must be half or full for a stalk with taper, which has no symmetry along Z",
            )
        radii = self.fixture.indenter_radius_mm + self.fixture.support_radius_mm
        if span <= 2.0 * radii:
            raise SpecificationError(
                "fixture.span_mm",
                span,
                f"must be above {2.0 * radii:g} mm, or the indenter does not pass the supports",
            )
