"""The stalk: concentric layers around a void or a solid core."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ramiefenics.specification.bond import Bond
from ramiefenics.specification.checks import check_instance, check_number, check_table
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.material import Elastic, Material
from ramiefenics.specification.tissue import Tissue

Places = TypeVar("Places", float, NDArray[np.floating[Any]])

NODE_POISSON = 0.3

LONGEST_MM = 2e5
"""Greatest length of a stalk: no plant is as long."""


@dataclass(frozen=True)
class Layer:
    """One concentric layer.

    Attributes
    ----------
    name
        Name, one word; also that of the physical group in the mesh.
    outer_diameter_mm
        Outer diameter; the inner diameter is the outer one of the layer inside, or the void's.
    material
        Material of the layer.
    """

    name: str
    outer_diameter_mm: float
    material: Material

    def __post_init__(self) -> None:
        """Check name and diameter."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise SpecificationError(
                "name", self.name, "must be one word of letters, digits and underscores"
            )
        check_number(self, "outer_diameter_mm", above=0.0, unit="mm")
        check_instance(self, "material", Material)


THINNEST = 1e-4
"""Least thickness of a layer, and least diameter of a void, over the stalk's diameter."""


@dataclass(frozen=True)
class Stalk:
    """A specimen.

    Attributes
    ----------
    length_mm
        Length along the stalk's axis, which is Z unless the stalk is bowed.
    void_diameter_mm
        Diameter of the pith void; 0 for a solid core.
    layers
        Layers, from the inside out.
    section_height_mm
        Height of an elliptic section, along Y. The diameters are then widths, along X, and void and
        layers have the proportions of the outer ellipse. If left out, the section is a circle.
    rotation_deg
        Angle by which the section is turned about the stalk's axis, from X to Y.
    taper
        Loss of outer diameter per length along Z; the sections stay geometrically similar.
    measured_at_mm
        Z of the section that has the given diameters; 0 is midspan.
    position_mm
        Position of midspan on the plant, for instance its height above ground.
    stiffness_gradient_per_m
        Relative change of all moduli of all layers per metre of `position_mm`; the given moduli are
        those at `reference_position_mm`. The whole specimen has the moduli of its midspan: if one
        side is stiffer and the other softer, the force does not change to first order.
    reference_position_mm
        Position on the plant where the moduli are the given ones.
    place_mm
        Positions on the plant, ascending, for which `place_factor` states factors.
    place_factor
        Factors on all moduli of all layers at the positions `place_mm`; linear in between, constant
        beyond.
    moisture
        Mass of water over dry mass.
    moisture_softening
        Relative loss of all moduli of all layers per unit of `moisture`: they are multiplied by
        ``exp(-moisture_softening (moisture - reference_moisture))``.
    reference_moisture
        Moisture at which the moduli are the given ones.
    void_offset_mm
        Height of the void's centre above the stalk's axis, along the section's height; positive
        towards the indenter, if the section is not turned. The innermost layer is thinner on that
        side; the others are concentric.
    node_thickness_mm
        Thickness along Z of a node, a diaphragm that closes the void; 0 for none. As fibres cross
        in a node, its material is that of the innermost layer, but isotropic and in all directions
        as stiff as that layer is along its fibres.
    node_at_mm
        Z of the middle of the node.
    curvature_per_m
        Curvature of the stalk's axis before loading, an arc whose top is at midspan: the ends are
        lower if it is positive, higher if it is negative. Fibres follow the arc.
    tissue
        Variation of the tissue within the stalk.
    bond
        Bond of the outermost layer to the one inside it.
    """

    length_mm: float
    void_diameter_mm: float
    layers: tuple[Layer, ...]
    section_height_mm: float | None = None
    rotation_deg: float = 0.0
    taper: float = 0.0
    measured_at_mm: float = 0.0
    position_mm: float = 0.0
    stiffness_gradient_per_m: float = 0.0
    reference_position_mm: float = 0.0
    place_mm: tuple[float, ...] = ()
    place_factor: tuple[float, ...] = ()
    moisture: float = 0.0
    moisture_softening: float = 0.0
    reference_moisture: float = 0.0
    void_offset_mm: float = 0.0
    node_thickness_mm: float = 0.0
    node_at_mm: float = 0.0
    curvature_per_m: float = 0.0
    tissue: Tissue = field(default_factory=Tissue)
    bond: Bond = field(default_factory=Bond)

    def __post_init__(self) -> None:
        """Check values, that diameters increase outwards, and that names are unique."""
        check_number(self, "length_mm", above=0.0, at_most=LONGEST_MM, unit="mm")
        check_number(self, "void_diameter_mm", at_least=0.0, unit="mm")
        object.__setattr__(self, "layers", tuple(self.layers))
        if not self.layers:
            raise SpecificationError("layers", [], "must have at least one layer")
        inner = self.void_diameter_mm
        inside = "void_diameter_mm"
        names: set[str] = set()
        for layer in self.layers:
            if layer.outer_diameter_mm <= inner:
                raise SpecificationError(
                    f"layers.{layer.name}.outer_diameter_mm",
                    layer.outer_diameter_mm,
                    f"must be above {inside} = {inner:g} mm, as layers go from the inside out",
                )
            if layer.name in names:
                raise SpecificationError("layers", layer.name, "must not name a layer twice")
            names.add(layer.name)
            inner = layer.outer_diameter_mm
            inside = f"layers.{layer.name}.outer_diameter_mm"
        self._check_thickness()
        check_instance(self, "tissue", Tissue)
        if self.section_height_mm is not None:
            check_number(self, "section_height_mm", above=0.0, unit="mm")
        for name in (
            "rotation_deg",
            "taper",
            "measured_at_mm",
            "position_mm",
            "stiffness_gradient_per_m",
            "reference_position_mm",
            "void_offset_mm",
            "node_at_mm",
        ):
            check_number(self, name)
        check_table(self, "place_mm", "place_factor", above=0.0)
        for name in ("moisture", "reference_moisture"):
            check_number(self, name, at_least=0.0, at_most=20.0)
        check_number(self, "moisture_softening", at_least=-20.0, at_most=20.0)
        if min(self.scale_at(-self.length_mm / 2.0), self.scale_at(self.length_mm / 2.0)) < 0.1:
            raise SpecificationError(
                "taper", self.taper, "must leave a tenth of the diameter at either end"
            )
        limit = 1000.0 / self.length_mm  # one radian from end to end
        check_number(self, "curvature_per_m", at_least=-limit, at_most=limit, unit="1/m")
        self._check_void()
        self._check_node()
        check_instance(self, "bond", Bond)
        if not self.bond.perfect and len(self.layers) == 1:
            allowed = "must be 0 for a stalk of one layer, which has nothing to be bonded to"
            compliance = self.bond.compliance_mm_per_MPa
            raise SpecificationError("bond.compliance_mm_per_MPa", compliance, allowed)
        if self.position_factor <= 0.0:
            raise SpecificationError(
                "stiffness_gradient_per_m",
                self.stiffness_gradient_per_m,
                f"must leave positive moduli at position_mm = {self.position_mm:g}, which is "
                f"{self.position_mm - self.reference_position_mm:g} mm from where they are given",
            )

    def _check_thickness(self) -> None:
        """Check that the void is not as narrow as a line, nor a layer as thin as a surface."""
        least = THINNEST * self.outer_diameter_mm
        if 0.0 < self.void_diameter_mm < least:
            allowed = (
                f"must be 0 or at least {least:.3g} mm, a ten-thousandth of the stalk's diameter"
            )
            raise SpecificationError("void_diameter_mm", self.void_diameter_mm, allowed)
        for layer, (inner, outer) in zip(
            self.layers, itertools.pairwise(self.radii_mm), strict=True
        ):
            if outer - inner < least:
                allowed = f"must leave the layer at least {least:.3g} mm thick"
                field = f"layers.{layer.name}.outer_diameter_mm"
                raise SpecificationError(field, layer.outer_diameter_mm, allowed)

    def _check_void(self) -> None:
        """Check that an eccentric void lies within the innermost layer."""
        if self.void_offset_mm == 0.0:
            return
        if self.void_diameter_mm == 0.0:
            allowed = "must be 0 for a solid core"
            raise SpecificationError("void_offset_mm", self.void_offset_mm, allowed)
        inner, outer = self.radii_mm[:2]
        limit = 0.9 * (outer - inner) * self.height_mm / self.outer_diameter_mm
        if abs(self.void_offset_mm) > limit:
            allowed = f"must be at most {limit:g} mm, or the innermost layer is too thin there"
            raise SpecificationError("void_offset_mm", self.void_offset_mm, allowed)

    def _check_node(self) -> None:
        """Check that there is a void for the node to close, and that the node is in the stalk."""
        check_number(self, "node_thickness_mm", at_least=0.0, unit="mm")
        if self.node_thickness_mm == 0.0:
            return
        if self.void_diameter_mm == 0.0:
            allowed = "must be 0 for a solid core"
            raise SpecificationError("node_thickness_mm", self.node_thickness_mm, allowed)
        limit = self.length_mm / 2.0 - self.node_thickness_mm / 2.0
        if abs(self.node_at_mm) >= limit:
            allowed = f"must be within {limit:g} mm of midspan, or the node is not in the stalk"
            raise SpecificationError("node_at_mm", self.node_at_mm, allowed)

    @property
    def node_mm(self) -> tuple[float, float] | None:
        """Z of the two faces of the node; None if there is no node."""
        if self.node_thickness_mm == 0.0:
            return None
        half = self.node_thickness_mm / 2.0
        return self.node_at_mm - half, self.node_at_mm + half

    @property
    def materials(self) -> tuple[Material, ...]:
        """Materials of the layers, inside out, then of the node, if any; moduli as at midspan."""
        made = [layer.material for layer in self.layers]
        if self.node_mm is not None:
            elastic = Elastic.isotropic(made[0].elastic.E_Z_MPa, NODE_POISSON)
            made.append(replace(made[0], elastic=elastic))
        return tuple(material.scaled(self.stiffness_factor) for material in made)

    def void_centre_mm(self, z_mm: float) -> tuple[float, float]:
        """Return X and Y of the void's centre at Z, mm."""
        angle, offset = math.radians(self.rotation_deg), self.scale_at(z_mm) * self.void_offset_mm
        return -offset * math.sin(angle), offset * math.cos(angle)

    def scale_at(self, z_mm: Places) -> Places:
        """Return the ratio of the diameters at Z to the given ones."""
        return 1.0 - self.taper * (z_mm - self.measured_at_mm) / self.outer_diameter_mm

    def measured_at_midspan(self) -> Stalk:
        """Return the same stalk, described by its section at midspan."""
        scale = self.scale_at(0.0)
        return replace(
            self,
            measured_at_mm=0.0,
            layers=tuple(
                replace(layer, outer_diameter_mm=scale * layer.outer_diameter_mm)
                for layer in self.layers
            ),
            void_diameter_mm=scale * self.void_diameter_mm,
            void_offset_mm=scale * self.void_offset_mm,
            section_height_mm=None if self.section_height_mm is None else scale * self.height_mm,
        )

    @property
    def position_factor(self) -> float:
        """Factor of the stiffness gradient on the moduli, at midspan's position on the plant."""
        metres = (self.position_mm - self.reference_position_mm) / 1000.0
        return 1.0 + self.stiffness_gradient_per_m * metres

    def factor_at(self, position_mm: Places) -> Places:
        """Return the factor on the moduli, by `place_factor`, at positions on the plant."""
        if not self.place_mm:
            return 1.0 + 0.0 * position_mm
        factor = np.interp(position_mm, self.place_mm, self.place_factor)
        return factor if isinstance(position_mm, np.ndarray) else float(factor)

    @property
    def moisture_factor(self) -> float:
        """Factor of the moisture on the moduli."""
        return math.exp(self.moisture_softening * (self.reference_moisture - self.moisture))

    @property
    def stiffness_factor(self) -> float:
        """Ratio of the moduli at midspan to the given ones."""
        return self.position_factor * self.factor_at(self.position_mm) * self.moisture_factor

    @property
    def outer_diameter_mm(self) -> float:
        """Diameter of the stalk where it was measured; its width if the section is an ellipse."""
        return self.layers[-1].outer_diameter_mm

    @property
    def height_mm(self) -> float:
        """Height of the section where it was measured, before it is turned."""
        height = self.section_height_mm
        return self.outer_diameter_mm if height is None else height

    @property
    def top_mm(self) -> float:
        """Height of the turned section's highest point above the stalk's axis."""
        angle = math.radians(self.rotation_deg)
        width, height = self.outer_diameter_mm, self.height_mm
        return math.hypot(height * math.cos(angle), width * math.sin(angle)) / 2.0

    @property
    def radii_mm(self) -> tuple[float, ...]:
        """Radii of the void and of all layers, inside out; one more than there are layers."""
        return (
            self.void_diameter_mm / 2.0,
            *(layer.outer_diameter_mm / 2.0 for layer in self.layers),
        )
