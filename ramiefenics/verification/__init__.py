"""Studies that check the solver against what is known; `ramiefenics verify` runs them."""

from collections.abc import Callable

from ramiefenics.verification.balance import balance
from ramiefenics.verification.beam import beam
from ramiefenics.verification.brazier import brazier
from ramiefenics.verification.codes import closed, pinned, pressed
from ramiefenics.verification.constants import constants
from ramiefenics.verification.hertz import hertz, penalty
from ramiefenics.verification.locking import locking
from ramiefenics.verification.manufactured import manufactured
from ramiefenics.verification.patch import patch
from ramiefenics.verification.report import Verification
from ramiefenics.verification.sliding import sliding
from ramiefenics.verification.stability import stability
from ramiefenics.verification.study import Check, Plot, Series, Study
from ramiefenics.verification.tangent import tangent
from ramiefenics.verification.task import StudyTask

STUDIES: dict[str, Callable[[], Study]] = {
    study.__name__: study
    for study in (
        constants,
        stability,
        patch,
        manufactured,
        locking,
        hertz,
        penalty,
        sliding,
        tangent,
        balance,
        beam,
        brazier,
        pinned,
        pressed,
        closed,
    )
}
"""All studies by name, in the order of the report; a new one is listed here."""

__all__ = ["STUDIES", "Check", "Plot", "Series", "Study", "StudyTask", "Verification"]
