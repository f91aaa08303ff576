"""Contact pressure and stick or slip as fields on the stalk's surface."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem, la
from numpy.typing import NDArray

from ramiefenics.model.contact import Contact
from ramiefenics.model.jit import compile_form

NO_CONTACT, STICK, SLIP = 0, 1, 2


class SurfaceFields:
    """Averages of contact quantities around the surface's vertices.

    Parameters
    ----------
    contact
        Where they come from.
    """

    def __init__(self, contact: Contact) -> None:
        mesh = contact.solid.mesh
        self._space = fem.functionspace(mesh, ("Lagrange", 1, (4,)))
        w = ufl.TestFunction(self._space)
        touching, slipping = contact.states()
        values = ufl.as_vector((1, contact.pressure, touching, slipping))
        self._form = compile_form(ufl.dot(values, w) * contact.ds)

    def evaluate(self) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
        """Return pressure, MPa, and state at the mesh's vertices, both shape (vertices,).

        The order is that of the first-order scalar Lagrange space's degrees of freedom,
        ghosts included. States are `NO_CONTACT`, `STICK` and `SLIP`.
        """
        vector = fem.assemble_vector(self._form)
        vector.scatter_reverse(la.InsertMode.add)
        vector.scatter_forward()
        area, pressure, touching, slipping = vector.array.reshape(-1, 4).T
        weight = np.where(area > 0.0, area, 1.0)
        state = np.where(touching < 0.5 * weight, NO_CONTACT, STICK)
        state[(state == STICK) & (slipping >= 0.5 * touching)] = SLIP
        return pressure / weight, state.astype(np.int8)
