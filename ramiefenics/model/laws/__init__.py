"""Hyperelastic laws, one module each; a new one is listed here."""

from ramiefenics.model.laws.base import Law
from ramiefenics.model.laws.neo_hookean import NEO_HOOKEAN
from ramiefenics.model.laws.saint_venant_kirchhoff import SAINT_VENANT_KIRCHHOFF
from ramiefenics.model.laws.saturating_fibre import SATURATING_FIBRE

LAWS: dict[str, Law] = {
    law.name: law for law in (SATURATING_FIBRE, NEO_HOOKEAN, SAINT_VENANT_KIRCHHOFF)
}

__all__ = ["LAWS", "Law"]
