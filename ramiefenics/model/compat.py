"""All code that depends on the release of dolfinx, from 0.9 to 0.11.

Two more differences need no code here, only calls that suit every release. Since 0.10,
`Expression.eval` returns values in their shape, not flattened for each cell, so callers reshape
them; and `mesh.create_mesh` takes coordinates and element in the opposite order, so callers pass
them by name.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import cffi
import dolfinx
import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from dolfinx.fem.forms import CompiledForm, get_integration_domains
from numpy.typing import NDArray

from ramiefenics.model.structure import Structure

try:  # dolfinx >= 0.10
    from dolfinx.io import gmsh as _gmshio
except ImportError:  # dolfinx 0.9
    from dolfinx.io import gmshio as _gmshio

VERSION: str = dolfinx.__version__


def mesh_from_gmsh(gmsh_model: Any, comm: Any) -> tuple[dmesh.Mesh, dmesh.MeshTags, dmesh.MeshTags]:
    """Distribute a Gmsh model over `comm`.

    Parameters
    ----------
    gmsh_model
        ``gmsh.model`` on rank 0; ignored elsewhere.
    comm
        MPI communicator of the mesh.

    Returns
    -------
    tuple
        The mesh, its cell tags and its facet tags.
    """
    z = np.zeros(0)
    if comm.rank == 0:
        tags, coordinates, _ = gmsh_model.mesh.getNodes()
        z = coordinates[2::3][np.argsort(tags)]  # in dolfinx's numbering
    # dolfinx >= 0.10 returns more than these three
    mesh, cells, facets = _gmshio.model_to_mesh(gmsh_model, comm, 0, 3, _slices(z))[:3]
    return mesh, cells, facets


def _slices(z: NDArray[np.float64]) -> Any:
    """Return a partitioner that cuts hexahedra, all on rank 0, into slices of equal size along Z.

    As a tube is long, slices share few nodes, and unlike the result of a graph partitioner they are
    the same every time.

    Parameters
    ----------
    z
        Z of every node, by its number.
    """

    def partition(comm: Any, parts: int, _: Any, cells: list[NDArray[np.int64]]) -> Any:
        middles = z[cells[0].reshape(-1, 8)].mean(axis=1)
        number = len(middles)
        ranks = np.empty((number, 1), dtype=np.int32)
        ranks[np.argsort(middles, kind="stable"), 0] = np.arange(number) * parts // number
        return dolfinx.cpp.graph.AdjacencyList_int32(ranks)

    return partition


def geometry_order(mesh: dmesh.Mesh) -> int:
    """Return the polynomial order of a mesh's cells."""
    geometry = mesh.geometry
    # dolfinx >= 0.11 has one map per cell type, and deprecates the single one
    element = geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap
    return int(element.degree)


def geometry_nodes(mesh: dmesh.Mesh) -> NDArray[np.int32]:
    """Return the geometry nodes of every cell among the mesh's points, shape (cells, nodes)."""
    geometry = mesh.geometry
    # see `geometry_order`
    nodes = geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap
    return np.asarray(nodes)


def evaluate_on_facets(expression: Any, mesh: dmesh.Mesh, facets: NDArray[np.int32]) -> Any:
    """Evaluate an expression that is compiled for points of a facet.

    Parameters
    ----------
    expression
        Expression to evaluate.
    mesh
        Mesh of the facets.
    facets
        Cell, and number of the facet in the cell, shape (m, 2).

    Returns
    -------
    numpy.ndarray
        Values by facet, point and component, in a shape that depends on the release.
    """
    # dolfinx 0.9 expects the pairs in a flat array
    return expression.eval(mesh, facets.ravel() if VERSION.startswith("0.9.") else facets)


def form_with(compiled: CompiledForm, parts: Structure) -> fem.Form:
    """Return a compiled form with the mesh and the data of its UFL form.

    Parameters
    ----------
    compiled
        Compiled form, whose code may be that of another form of the same structure.
    parts
        Structure of the UFL form.
    """
    kernel, by_type = compiled.ufcx_form, compiled.ufl_form.subdomain_data()[parts.domain]
    subdomains = {}
    for name, tags in by_type.items():
        kind = getattr(fem.IntegralType, name)
        first, behind = kernel.form_integral_offsets[kind.value : kind.value + 2]
        ids = {kernel.form_integral_ids[i] for i in range(first, behind)} - {-1}  # -1 is everywhere
        subdomains[kind] = get_integration_domains(kind, tags[0], sorted(ids))
    used = [
        parts.coefficients[kernel.original_coefficient_positions[i]]
        for i in range(kernel.num_coefficients)
    ]
    # dolfinx 0.9 names them by the keys' positions in the UFL form, of which some are not used
    keys = parts.coefficients if VERSION.startswith("0.9.") else used
    return fem.create_form(
        compiled,
        [argument.ufl_function_space() for argument in parts.arguments],
        dmesh.Mesh(parts.mesh, parts.domain),
        subdomains,
        dict(zip(keys, used, strict=False)),
        {constant: constant for constant in parts.constants},
    )


def expression_with(
    compiled: fem.Expression,
    coefficients: Sequence[fem.Function],
    constants: Sequence[fem.Constant],
) -> fem.Expression:
    """Return a compiled expression without arguments, with other data.

    Parameters
    ----------
    compiled
        Compiled expression.
    coefficients, constants
        Data, in the order in which the compiled code takes them.
    """
    ffi, kernel = cffi.FFI(), compiled.ufcx_expression
    # dolfinx >= 0.11 takes maps to other meshes before an argument's space, which all releases take
    last: tuple = (None,) if VERSION.startswith(("0.9.", "0.10.")) else ([], None)
    expression = copy.copy(compiled)
    expression._cpp_object = dolfinx.cpp.fem.create_expression_float64(
        int(ffi.cast("uintptr_t", ffi.addressof(kernel))),
        [coefficient._cpp_object for coefficient in coefficients],
        [constant._cpp_object for constant in constants],
        *last,
    )
    return expression
