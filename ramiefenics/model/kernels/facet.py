"""Forces and stiffness of a traction on facets of hexahedra, by compiled C code."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import basix
import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from ufl.algorithms.analysis import extract_coefficients

from ramiefenics.model.kernels.assembled import (
    WIDTH,
    Array,
    AssembledKernel,
    Integers,
    cell_maps,
    padded,
    program,
)
from ramiefenics.model.kernels.lowering import Lowering
from ramiefenics.model.kernels.scalars import Graph
from ramiefenics.model.kernels.source import function
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.pieces import facet_frames
from ramiefenics.model.structure import Structure

DECLARATIONS = """
struct field {                  /* a function that the traction depends on */
  int32_t count, components;    /* of nodes in a cell; of values at each */
  int32_t place;                /* of the first component among what is given at the points */
  const int32_t *nodes;         /* by facet and node */
  const double *shapes;         /* by face of the reference cell, node and point */
  const double *values;         /* by node and component */
};

struct cells {                  /* with a facet each */
  int64_t count;                /* of facets */
  const int32_t *nodes;         /* by facet and node of its cell */
  const int32_t *faces;         /* which face of the reference cell, by facet */
  const double *shapes;         /* shape functions by face, node and point */
  const double *slopes;         /* theirs by face, direction, node and point */
  const double *inverse;        /* of the map from the reference cell: by facet, entry and point */
  const double *weight;         /* of the points: area, by facet and point */
  const double *geometry;       /* place and normal: by facet, component and point */
  const double *constants;
  const struct field *fields;
};
"""

ARGUMENTS = "const double *restrict at, const double *restrict constants, double duration"

ALWAYS = {"X": 3, "N": 3, "u": 3, "H": 9}
"""What is given at every point ahead of the fields, and the number of its components.

Position, normal, displacement and displacement gradient.
"""

_sources: dict[Hashable, str] = {}
"""C code that this process has generated, by structure."""


class FacetKernel(AssembledKernel):
    """Integrals of a traction over facets, at the current displacement.

    Parameters
    ----------
    traction
        Traction on the body, UFL shape (3,), a function of position, normal, displacement, its
        gradient, other functions and constants. Constants keep their values at construction, except
        the duration.
    apart
        UFL scalar, a function of position, displacement and other functions. A facet has no
        traction if this is not negative at any of its points.
    displacement
        The unknown.
    duration
        Duration of the step, s.
    facets
        Cell, and number of the facet in the cell, shape (m, 2), for cells that this rank owns.
    quadrature_degree
        Degree of the quadrature on the facets.

    Raises
    ------
    UnknownOperation
        If the traction contains an operation that has no counterpart in C.
    """

    def __init__(
        self,
        traction: Expr,
        apart: Expr,
        displacement: fem.Function,
        duration: fem.Constant,
        facets: Integers,
        quadrature_degree: int,
    ) -> None:
        space, (cells, faces) = displacement.function_space, facets.T
        points, weights = basix.make_quadrature(basix.CellType.quadrilateral, quadrature_degree)
        frames = facet_frames()  # of the faces: origin and two edges
        self._points = frames[:, :1] + np.einsum("qa,fai->fqi", points, frames[:, 1:])
        stated = ufl.as_vector([*traction, apart])
        parts, first = Structure(stated), extract_coefficients(apart)
        fields = [c for c in parts.coefficients if c != displacement]
        fields.sort(key=lambda field: field not in first)
        sizes = {
            "POINTS": len(points),
            "NODES": space.dofmap.list.shape[1],
            "PADDED_POINTS": padded(len(points)),
            "PADDED_NODES": padded(space.dofmap.list.shape[1]),
            "FIRST_FIELDS": sum(field in first for field in fields),
            "FIELDS": len(fields),
            "GIVEN": sum(ALWAYS.values()) + sum(_components(field) for field in fields),
            "WIDTH": WIDTH,
        }
        order = [parts.coefficients.index(c) for c in (displacement, *fields)]
        key = parts.signature, *order, tuple(sizes.items())
        if key not in _sources:
            generated = _generated(stated, parts, displacement, fields, duration)
            _sources[key] = program(sizes, (DECLARATIONS, generated), "facet.c")
        of_cells = space.dofmap.list[cells]
        super().__init__(_sources[key], DECLARATIONS, of_cells, len(cells), displacement, duration)
        self._kept: list[Any] = [*fields]  # and whatever else the structures point to
        inverse, weight, geometry = self._geometry(cells, faces, weights)
        constants = np.array([float(c.value) for c in parts.constants if c != duration] or [0.0])
        self._cells = self._ffi.new(
            "struct cells *",
            [
                len(cells),
                *map(self._keep, (self.nodes, faces, *self._shapes(space))),
                *map(self._keep, (inverse, weight, geometry, constants)),
                self._fields(fields, cells),
            ],
        )

    def _keep(self, array: NDArray[Any]) -> Any:
        array = np.ascontiguousarray(array)
        self._kept.append(array)
        return self._pointer(array)

    def _padded(self, values: NDArray[Any]) -> Array:
        """Repeat the last point, along the last axis, up to a whole multiple of `WIDTH`."""
        missing = padded(values.shape[-1]) - values.shape[-1]
        return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, missing)], mode="edge")

    def _shapes(self, space: fem.FunctionSpace) -> tuple[Array, Array]:
        """Return shape functions and their slopes at the points of every face."""
        element = space.element.basix_element
        found = np.stack([element.tabulate(1, points)[..., 0] for points in self._points])
        by_point = self._padded(found.transpose(0, 1, 3, 2))  # face, derivative, node, point
        return by_point[:, 0], by_point[:, 1:]

    def _geometry(
        self, cells: Integers, faces: Integers, weights: Array
    ) -> tuple[Array, Array, Array]:
        """Return inverse Jacobians, areas of the points, and positions with normals."""
        mesh, count = self._u.function_space.mesh, len(weights)
        normals = basix.cell.facet_outward_normals(basix.CellType.hexahedron)
        places, jacobian = np.empty((len(cells), count, 3)), np.empty((len(cells), count, 3, 3))
        for face, points in enumerate(self._points):
            here = faces == face
            places[here], jacobian[here] = cell_maps(mesh, cells[here], points)
        inverse = np.linalg.inv(jacobian)
        # Nanson's formula; the faces of the reference cell have unit area
        area = np.einsum("fqki,fk->fqi", inverse, normals[faces])
        area *= np.abs(np.linalg.det(jacobian))[..., None]
        size = np.linalg.norm(area, axis=-1)
        weight = np.zeros((len(cells), padded(count)))
        weight[:, :count] = weights * size
        geometry = np.concatenate([places, area / size[..., None]], axis=-1)
        by_point = (inverse.reshape(len(cells), count, 9), geometry)
        inverses, geometries = (self._padded(x.transpose(0, 2, 1)) for x in by_point)
        return inverses, weight, geometries

    def _fields(self, fields: Sequence[fem.Function], cells: Integers) -> Any:
        made, place = [], sum(ALWAYS.values())
        for field in fields:
            nodes = field.function_space.dofmap.list[cells]
            shapes = self._shapes(field.function_space)[0]
            pointers = self._keep(nodes), self._keep(shapes), self._pointer(field.x.array)
            made.append([nodes.shape[1], _components(field), place, *pointers])
            place += _components(field)
        self._kept.append(self._ffi.new("struct field[]", made))
        return self._kept[-1]


def _components(field: fem.Function) -> int:
    return int(field.function_space.dofmap.index_map_bs)


def _generated(
    stated: Expr,
    parts: Structure,
    displacement: fem.Function,
    fields: Sequence[fem.Function],
    duration: fem.Constant,
) -> str:
    """Return C functions for all points of a facet: the traction, its derivatives, and `apart`.

    ``traction_tangent`` gives the derivatives of every component with respect to the components of
    the displacement, then to those of its gradient.
    """
    graph, place = Graph(), 0
    places: dict[str, str] = {}

    def given(name: str, shape: tuple[int, ...]) -> NDArray[np.int64]:
        nonlocal place
        nodes = np.empty(shape, dtype=int)
        for component, index in enumerate(np.ndindex(*shape)):
            nodes[index] = graph.input(f"{name}{component}")
            places[f"{name}{component}"] = f"at[{place} * PADDED_POINTS + q]"
            place += 1
        return nodes

    x, normal, value, slope = (given(n, (3, 3) if c == 9 else (c,)) for n, c in ALWAYS.items())
    terminals = {
        ufl.SpatialCoordinate(parts.domain): x,
        ufl.FacetNormal(parts.domain): normal,
        displacement: value,
        ufl.grad(displacement): slope,
    }
    for number, field in enumerate(fields):
        terminals[field] = given(f"field{number}_", field.ufl_shape)
    of_facet = {"duration": "duration"}
    others = [constant for constant in parts.constants if constant != duration]
    for number, constant in enumerate(others):
        of_facet[f"constant{number}"] = f"constants[{number}]"
        terminals[constant] = np.array(graph.input(f"constant{number}"))
    terminals[duration] = np.array(graph.input("duration"))
    lowered = Lowering(graph, terminals).lower(stated)
    traction, apart = lowered[:3], lowered[3]
    sources = np.concatenate([value, slope.ravel()])
    rates = [graph.directional(traction, int(source)) for source in sources]
    results = {
        "value": traction,
        "tangent": [rate[i] for i in range(3) for rate in rates],
        "apart": [apart],
    }
    return "\n".join(
        function(f"traction_{n}", ARGUMENTS, graph, graph.unlabelled(ends), places, of_facet)
        for n, ends in results.items()
    )
