"""Effects that a simulation may be lacking, one module each; new ones are listed here."""

from ramiefenics.effects.bark_slip import BARK_SLIP
from ramiefenics.effects.base import Companion, Effect, load_effects
from ramiefenics.effects.bimodular_fibre import BIMODULAR_FIBRE
from ramiefenics.effects.crushing import CRUSHING
from ramiefenics.effects.curved_stalk import CURVED_STALK
from ramiefenics.effects.displacement_scale import DISPLACEMENT_SCALE
from ramiefenics.effects.eccentric_void import ECCENTRIC_VOID
from ramiefenics.effects.fibre_angle import FIBRE_ANGLE
from ramiefenics.effects.fibre_damage import FIBRE_DAMAGE
from ramiefenics.effects.fibre_strength import FIBRE_STRENGTH
from ramiefenics.effects.fibre_yield import FIBRE_YIELD
from ramiefenics.effects.fixture_radius import FIXTURE_RADIUS
from ramiefenics.effects.friction import FRICTION
from ramiefenics.effects.growth_stress import GROWTH_STRESS
from ramiefenics.effects.irreversible_damage import IRREVERSIBLE_DAMAGE
from ramiefenics.effects.load_offset import LOAD_OFFSET
from ramiefenics.effects.load_scale import LOAD_SCALE
from ramiefenics.effects.machine_compliance import MACHINE_COMPLIANCE
from ramiefenics.effects.moisture import MOISTURE
from ramiefenics.effects.node import NODE
from ramiefenics.effects.nonlinear_compliance import NONLINEAR_COMPLIANCE
from ramiefenics.effects.off_centre_indenter import OFF_CENTRE_INDENTER
from ramiefenics.effects.ovality import OVALITY
from ramiefenics.effects.pith_core import PITH_CORE
from ramiefenics.effects.radial_gradient import RADIAL_GRADIENT
from ramiefenics.effects.seating_gap import SEATING_GAP
from ramiefenics.effects.span_error import SPAN_ERROR
from ramiefenics.effects.stiffness_gradient import STIFFNESS_GRADIENT
from ramiefenics.effects.taper import TAPER
from ramiefenics.effects.viscoelastic import VISCOELASTIC
from ramiefenics.effects.wall_thickness_error import WALL_THICKNESS_ERROR

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        # machine
        MACHINE_COMPLIANCE,
        NONLINEAR_COMPLIANCE,
        SEATING_GAP,
        LOAD_SCALE,
        LOAD_OFFSET,
        DISPLACEMENT_SCALE,
        # fixture
        SPAN_ERROR,
        OFF_CENTRE_INDENTER,
        FIXTURE_RADIUS,
        FRICTION,
        # geometry
        OVALITY,
        WALL_THICKNESS_ERROR,
        ECCENTRIC_VOID,
        NODE,
        TAPER,
        CURVED_STALK,
        # material
        PITH_CORE,
        BIMODULAR_FIBRE,
        FIBRE_STRENGTH,
        FIBRE_DAMAGE,
        IRREVERSIBLE_DAMAGE,
        FIBRE_YIELD,
        CRUSHING,
        VISCOELASTIC,
        STIFFNESS_GRADIENT,
        MOISTURE,
        RADIAL_GRADIENT,
        FIBRE_ANGLE,
        GROWTH_STRESS,
        BARK_SLIP,
    )
}

REMEMBERING = (
    IRREVERSIBLE_DAMAGE,
    FIBRE_YIELD,
    CRUSHING,
    VISCOELASTIC,
    GROWTH_STRESS,
    BARK_SLIP,
)
"""Effects that a single loading hardly distinguishes from others."""

SUSPECTS: dict[str, Effect] = {
    name: effect for name, effect in EFFECTS.items() if effect not in REMEMBERING
}
"""Effects that `discover` tries by default."""

__all__ = ["EFFECTS", "SUSPECTS", "Companion", "Effect", "load_effects"]
