"""The stalk: concentric layers around a void or a solid core."""

from __future__ import annotations

from dataclasses import dataclass

from ramiefenics.specification.checks import check_instance, check_number
from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.material import Material


@dataclass(frozen=True)
class Layer:
    """One concentric layer.

    Attributes
    ----------
    name
        A word; the mesh's physical group carries it.
    outer_diameter_mm
        Outer diameter; the inner one is that of the layer inside, or of the void.
    material
        What it is made of.
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


@dataclass(frozen=True)
class Stalk:
    """A straight specimen of constant section.

    Attributes
    ----------
    length_mm
        Length along Z.
    void_diameter_mm
        Diameter of the pith void; 0 for a solid core.
    layers
        From the inside out.
    """

    length_mm: float
    void_diameter_mm: float
    layers: tuple[Layer, ...]

    def __post_init__(self) -> None:
        """Check that diameters increase from the void outwards and that names are unique."""
        check_number(self, "length_mm", above=0.0, unit="mm")
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

    @property
    def outer_diameter_mm(self) -> float:
        """Diameter of the stalk."""
        return self.layers[-1].outer_diameter_mm

    @property
    def radii_mm(self) -> tuple[float, ...]:
        """Radii of the void and of every layer, inside out; one more than there are layers."""
        return (
            self.void_diameter_mm / 2.0,
            *(layer.outer_diameter_mm / 2.0 for layer in self.layers),
        )
