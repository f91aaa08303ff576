"""State of contact on the stalk's surface, facet by facet."""

from __future__ import annotations

import basix
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from numpy.typing import NDArray

from ramiefenics.model.compat import evaluate_on_facets
from ramiefenics.model.contact import SURFACE_QUADRATURE_DEGREE, Contact
from ramiefenics.model.jit import compile_expression
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.pieces import cut_facets, on_facets, within_cells

NO_CONTACT, STICK, SLIP = 0, 1, 2


class ContactSurface:
    """The facets that a cylinder may touch, and the state of contact on them.

    A facet of second order is cut into four, each with the quadrature points within it. Nothing is
    averaged over more than that, so sums over the facets equal those of the weak form.

    Parameters
    ----------
    contact
        Contact, which gives facets and state.
    space
        Scalar Lagrange space of the solid's order.

    Attributes
    ----------
    corners
        Nodes of the space at the corners of each facet of this rank's cells, counter-clockwise as
        seen from outside, shape (m, 4).
    """

    def __init__(self, contact: Contact, space: fem.FunctionSpace) -> None:
        self._mesh = contact.solid.mesh
        order = contact.solid.order
        facets = np.unique(np.concatenate([o.facets for o in contact.obstacles]))
        self._facets = within_cells(self._mesh, facets)
        cells, places = self._facets.T
        at = cut_facets(space).reshape(-1, 4 * order**2)[places]
        nodes = np.take_along_axis(space.dofmap.list[cells], at, axis=1)
        self.corners = nodes.reshape(-1, 4).astype(np.int64)
        # the quadrature of `Contact.ds`; none of its points is on an edge of a piece
        points, weights = basix.make_quadrature(
            basix.CellType.quadrilateral, SURFACE_QUADRATURE_DEGREE[order]
        )
        self._points = _by_piece(self._mesh, self._facets, points, order)
        self._weights = weights[self._points].reshape(-1, self._points.shape[-1])
        stated = _at_points(contact)
        self._shape = (len(self._facets), len(points), *stated.ufl_shape)
        self._expression = compile_expression(stated, points)

    def evaluate(self) -> dict[str, NDArray[np.float64]]:
        """Return the state of contact on each facet.

        Returns
        -------
        dict
            ``contact_state``: `NO_CONTACT` where no quadrature point of the facet touches, else
            `SLIP` where at least half of the touching area slips, else `STICK`.
            ``contact_pressure_MPa`` and, of shape (m, 3), ``contact_traction_MPa`` and
            ``friction_traction_MPa``: means over the facet of the pressure, of the total traction
            on the stalk and of its tangential part, exactly zero where nothing touches.
            ``max_contact_pressure_MPa``: the highest pressure at the quadrature points.
            ``gap_mm``: the least distance of the quadrature points from the cylinder. ``slip_mm``,
            of shape (m, 3): the slip in this step, averaged over the touching points.
            ``area_mm2``: the area of the facet. Stresses and areas refer to the undeformed surface.
        """
        values = evaluate_on_facets(self._expression, self._mesh, self._facets)
        rows = np.arange(len(self._facets))[:, None, None]
        values = values.reshape(self._shape)[rows, self._points]
        values = values.reshape(*self._weights.shape, self._shape[-1])
        measure, touching, slipping, pressure, gap = np.moveaxis(values[..., :5], -1, 0)
        traction, friction, slip = np.split(values[..., 5:], 3, axis=-1)
        weights = measure * self._weights
        touched, slipped = (weights * touching).sum(axis=1), (weights * slipping).sum(axis=1)
        state = np.select([touched == 0.0, slipped < 0.5 * touched], [NO_CONTACT, STICK], SLIP)
        return {
            "area_mm2": weights.sum(axis=1),
            "contact_state": state.astype(np.int8),
            "contact_pressure_MPa": _mean(pressure, weights),
            "max_contact_pressure_MPa": pressure.max(axis=1),
            "contact_traction_MPa": _mean(traction, weights),
            "friction_traction_MPa": _mean(friction, weights),
            "gap_mm": gap.min(axis=1),
            "slip_mm": _mean(slip, weights * touching),
        }


def _by_piece(
    mesh: dmesh.Mesh, facets: NDArray[np.int32], points: NDArray[np.float64], order: int
) -> NDArray[np.int64]:
    """Sort the points of facets by the pieces of `cut_facets` that contain them.

    Where a point of the reference facet is on a cell's facet depends on the release of dolfinx and,
    since 0.10, on the facet's orientation. It is therefore determined by evaluating a function
    whose values are the reference coordinates of every cell.

    Returns
    -------
    numpy.ndarray
        Numbers of the points, shape (facets, order^2, points / order^2).
    """
    space = fem.functionspace(mesh, ("DG", 1, (3,)))
    place = fem.Function(space)
    place.x.array.reshape(-1, 3)[space.dofmap.list] = space.element.basix_element.points
    places = evaluate_on_facets(compile_expression(place, points), mesh, facets)
    at = on_facets(places.reshape(len(facets), len(points), 3), facets[:, 1])
    row, column = (at * order).astype(int)
    ordered = np.argsort(row * order + column, axis=1, kind="stable")
    return ordered.reshape(len(facets), order**2, len(points) // order**2)


def _at_points(contact: Contact) -> Expr:
    """Return the UFL vector of what is needed at a quadrature point, area per reference area first.

    The order is that in which `ContactSurface.evaluate` takes it apart.
    """
    mesh = contact.solid.mesh
    J = ufl.Jacobian(mesh)
    # Nanson's formula; the faces of the reference cell have unit area
    area = ufl.det(J) * ufl.inv(J).T * ufl.classes.ReferenceNormal(mesh)
    return ufl.as_vector(
        (
            ufl.sqrt(ufl.dot(area, area)),
            *contact.states(),
            contact.pressure,
            contact.gap,
            *contact.traction,
            *contact.friction,
            *contact.slip,
        )
    )


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Average over the points, axis 1; zero where all weights are zero."""
    total = weights.sum(axis=1)
    sums = np.einsum("fq,fq...->f...", weights, values)
    return (sums.T / np.where(total > 0.0, total, 1.0)).T
