"""Suspected causes: what a simulation may be lacking, one module each; a new one is listed here."""

from ramiefenics.effects.base import Effect, load_effects
from ramiefenics.effects.fibre_damage import FIBRE_DAMAGE
from ramiefenics.effects.machine_compliance import MACHINE_COMPLIANCE
from ramiefenics.effects.pith_core import PITH_CORE
from ramiefenics.effects.seating_gap import SEATING_GAP
from ramiefenics.effects.stiffness_gradient import STIFFNESS_GRADIENT
from ramiefenics.effects.taper import TAPER

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        MACHINE_COMPLIANCE,
        SEATING_GAP,
        PITH_CORE,
        TAPER,
        FIBRE_DAMAGE,
        STIFFNESS_GRADIENT,
    )
}

__all__ = ["EFFECTS", "Effect", "load_effects"]
