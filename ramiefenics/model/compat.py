"""The one place where releases 0.9 to 0.11 of dolfinx differ for us."""

from __future__ import annotations

from typing import Any

import dolfinx
from dolfinx import mesh as dmesh

try:  # dolfinx >= 0.10
    from dolfinx.io import gmsh as _gmshio
except ImportError:  # dolfinx 0.9
    from dolfinx.io import gmshio as _gmshio

VERSION: str = dolfinx.__version__


def mesh_from_gmsh(
    gmsh_model: Any, comm: Any, rank: int = 0
) -> tuple[dmesh.Mesh, dmesh.MeshTags, dmesh.MeshTags]:
    """Distribute a Gmsh model over `comm`.

    Parameters
    ----------
    gmsh_model
        ``gmsh.model`` on `rank`; ignored elsewhere.
    comm
        MPI communicator of the mesh.
    rank
        The rank that holds the Gmsh model.

    Returns
    -------
    tuple
        The mesh, its cell tags and its facet tags.
    """
    data = _gmshio.model_to_mesh(gmsh_model, comm, rank, gdim=3)
    if hasattr(data, "mesh"):  # dolfinx >= 0.10 returns a named tuple with more fields
        return data.mesh, data.cell_tags, data.facet_tags
    return data[0], data[1], data[2]
