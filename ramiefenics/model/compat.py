"""The one place where releases 0.9 to 0.11 of dolfinx differ for us.

Two more differences need no code, only calls that suit every release: since 0.10
`Expression.eval` returns values in their shape, not flattened for each cell, so ours are reshaped;
and `mesh.create_mesh` takes coordinates and element in the other order, so ours go by name.
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
        z = coordinates[2::3][np.argsort(tags)]  # dolfinx numbers them in this order
    # dolfinx >= 0.10 returns more behind these three
    mesh, cells, facets = _gmshio.model_to_mesh(gmsh_model, comm, 0, 3, _slices(z))[:3]
    return mesh, cells, facets


def _slices(z: NDArray[np.float64]) -> Any:
    """Return a partitioner of hexahedra, all on rank 0, that cuts across Z into equal shares.

    A tube is long, so few nodes are shared, and unlike that of a graph's partitioner the result is
    the same every time.

    Parameters
    ----------
    z
        Of every node, by its number.
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
    # dolfinx >= 0.11 has one map per type of cell, and deprecates the single one
    element = geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap
    return int(element.degree)


def geometry_nodes(mesh: dmesh.Mesh) -> NDArray[np.int32]:
    """Return the nodes of every cell's map among the mesh's points, shape (cells, nodes)."""
    geometry = mesh.geometry
    # likewise
    nodes = geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap
    return np.asarray(nodes)


def evaluate_on_facets(expression: Any, mesh: dmesh.Mesh, facets: NDArray[np.int32]) -> Any:
    """Evaluate an expression, compiled for points of a facet.

    Parameters
    ----------
    expression
        What to evaluate.
    mesh
        Where.
    facets
        Cell, and number of the facet in the cell, shape (m, 2).

    Returns
    -------
    numpy.ndarray
        Values by facet, point and component, in a shape that depends on the release.
    """
    # dolfinx 0.9 wants the pairs one behind the other
    return expression.eval(mesh, facets.ravel() if VERSION.startswith("0.9.") else facets)


def form_with(compiled: CompiledForm, parts: Structure) -> fem.Form:
    """Return a form that has been compiled with the mesh and the data of its statement in UFL.

    Parameters
    ----------
    compiled
        The form; its code may be that of another of the same structure.
    parts
        Of its statement.
    """
    kernel, by_type = compiled.ufcx_form, compiled.ufl_form.subdomain_data()[parts.domain]
    subdomains = {}
    for name, tags in by_type.items():
        kind = getattr(fem.IntegralType, name)
        first, behind = kernel.form_integral_offsets[kind.value : kind.value + 2]
        ids = {kernel.form_integral_ids[i] for i in range(first, behind)} - {-1}  # everywhere
        subdomains[kind] = get_integration_domains(kind, tags[0], sorted(ids))
    used = [
        parts.coefficients[kernel.original_coefficient_positions[i]]
        for i in range(kernel.num_coefficients)
    ]
    # dolfinx 0.9 names them by where the keys are in the statement, of which some are not used
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
    """Return an expression without arguments that has been compiled, with other data.

    Parameters
    ----------
    compiled
        The expression.
    coefficients, constants
        The data in the order of its code.
    """
    ffi, kernel = cffi.FFI(), compiled.ufcx_expression
    # dolfinx >= 0.11 takes maps to other meshes, then, like the others, the space of an argument
    last: tuple = (None,) if VERSION.startswith(("0.9.", "0.10.")) else ([], None)
    expression = copy.copy(compiled)
    expression._cpp_object = dolfinx.cpp.fem.create_expression_float64(
        int(ffi.cast("uintptr_t", ffi.addressof(kernel))),
        [coefficient._cpp_object for coefficient in coefficients],
        [constant._cpp_object for constant in constants],
        *last,
    )
    return expression
