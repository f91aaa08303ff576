"""Specifications of tests: nested immutable dataclasses, read from and written to TOML."""

from ramiefenics.specification.bending import BendingTest
from ramiefenics.specification.bond import Bond
from ramiefenics.specification.cylinder import Cylinder
from ramiefenics.specification.errors import SpecificationError, SpecificationWarning
from ramiefenics.specification.files import override, read_test
from ramiefenics.specification.fixture import Fixture
from ramiefenics.specification.friction import Friction
from ramiefenics.specification.general_fixture import GeneralFixture
from ramiefenics.specification.machine import Machine
from ramiefenics.specification.material import Elastic, LargeStrain, Material
from ramiefenics.specification.mesh_recipe import MeshRecipe, mesh_recipe, recipe_names
from ramiefenics.specification.numerics import ContactMethod, Explicit, Numerics, Stepping
from ramiefenics.specification.protocol import Protocol, Target
from ramiefenics.specification.sources import write_test
from ramiefenics.specification.stalk import Layer, Stalk
from ramiefenics.specification.tissue import Tissue

__all__ = [
    "BendingTest",
    "Bond",
    "ContactMethod",
    "Cylinder",
    "Elastic",
    "Explicit",
    "Fixture",
    "Friction",
    "GeneralFixture",
    "LargeStrain",
    "Layer",
    "Machine",
    "Material",
    "MeshRecipe",
    "Numerics",
    "Protocol",
    "SpecificationError",
    "SpecificationWarning",
    "Stalk",
    "Stepping",
    "Target",
    "Tissue",
    "mesh_recipe",
    "override",
    "read_test",
    "recipe_names",
    "write_test",
]
