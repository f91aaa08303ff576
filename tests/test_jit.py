"""Compiled forms: the cache on disk, and that in a process."""

from __future__ import annotations

import gc
import time
import weakref
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ramiefenics.model import jit
from ramiefenics.model.kernels import library
from ramiefenics.model.seal import is_sound


def test_killed_compilation_blocks_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """FFCx alone would wait ten seconds for the compiled file, then raise TimeoutError."""
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    mesh = dmesh.create_interval(MPI.COMM_SELF, 3, (0.0, 2.0))
    length = fem.Constant(mesh, 1.0) * ufl.dx
    jit.compile_form(length)
    (finished,) = tmp_path.glob("*/*.c.cached")
    finished.unlink()  # as if the compilation had been killed
    monkeypatch.setattr(jit, "_forms", {})  # as if this were another process
    start = time.monotonic()
    assert fem.assemble_scalar(jit.compile_form(length)) == pytest.approx(2.0)
    assert time.monotonic() - start < 8.0


def damage(path: Path) -> None:
    """Change one bit in the middle of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.unlink()  # a library that is already loaded stays as it was
    path.write_bytes(content)


def test_damaged_form_is_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    monkeypatch.setattr(jit, "_forms", {})
    mesh = dmesh.create_interval(MPI.COMM_SELF, 3, (0.0, 5.0))
    length = fem.Constant(mesh, 2.0) * ufl.dx
    jit.compile_form(length)
    (product,) = tmp_path.glob("*/*.so")
    whole = product.read_bytes()
    damage(product)
    monkeypatch.setattr(jit, "_forms", {})
    assert fem.assemble_scalar(jit.compile_form(length)) == pytest.approx(10.0)
    assert product.read_bytes() == whole


def test_damaged_kernel_is_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "FOLDER", tmp_path)
    source, declaration = "int damaged(void) { return 7; }", "int damaged(void);"
    assert library.compiled(source, declaration).lib.damaged() == 7
    (product,) = tmp_path.glob("*.so")
    made = product.stat().st_mtime_ns
    library.compiled.cache_clear()  # as if this were another process
    library.compiled(source, declaration)
    assert product.stat().st_mtime_ns == made
    damage(product)
    library.compiled.cache_clear()
    assert library.compiled(source, declaration).lib.damaged() == 7
    assert is_sound(product)


def strip(length: float) -> tuple[dmesh.Mesh, fem.Function, fem.Function]:
    """Return a rod, a function that is its coordinate, and one that is zero."""
    mesh = dmesh.create_interval(MPI.COMM_SELF, 4, (0.0, length))
    space = fem.functionspace(mesh, ("Lagrange", 2))
    x = fem.Function(space)
    x.interpolate(lambda at: at[0])
    return mesh, x, fem.Function(space)


def moment(length: float, factor: float, at_end: bool = False) -> float:
    """Return the integral or end value of ``factor * d/du (u^2 w) = 2 factor u w``, u = w = x."""
    mesh, x, unused = strip(length)
    u, scale = fem.Function(x.function_space), fem.Constant(mesh, factor)
    u.x.array[:] = x.x.array
    end = dmesh.locate_entities_boundary(mesh, 0, lambda at: np.isclose(at[0], length))
    tags = dmesh.meshtags(mesh, 0, end, np.full(len(end), 7, dtype=np.int32))
    measure = ufl.Measure("ds", mesh, subdomain_data=tags)(7) if at_end else ufl.dx(mesh)
    # linear in `unused`, which the derivative therefore does not contain
    energy = scale * u**2 * x + unused
    v = ufl.TestFunction(x.function_space)
    form = jit.compile_form(ufl.derivative(energy * measure, u, v))
    return float(fem.assemble_vector(form).array.sum())


@pytest.mark.parametrize("at_end", [False, True])
def test_form_is_compiled_once_for_all_meshes_and_data(
    at_end: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def exact(length: float, factor: float) -> float:
        return 2 * factor * length**2 if at_end else 2 * factor * length**3 / 3

    # the test functions sum up to one; the quadrature is exact
    assert moment(2.0, 1.0, at_end) == pytest.approx(exact(2.0, 1.0), rel=1e-12)
    monkeypatch.delattr(fem, "compile_form")
    assert moment(3.0, 5.0, at_end) == pytest.approx(exact(3.0, 5.0), rel=1e-12)


def test_expression_is_compiled_once_for_all_meshes_and_data(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def slope(length: float, factor: float) -> float:
        """Return the derivative of ``factor * x^2`` by x, in the middle of the last cell."""
        mesh, x, unused = strip(length)
        at, scale = ufl.variable(x), fem.Constant(mesh, factor)
        offset = fem.Constant(mesh, 1.0)
        energy = scale * at**2 + unused + offset
        expression = jit.compile_expression(ufl.diff(energy, at), np.array([[0.5]]))
        return float(np.ravel(expression.eval(mesh, np.array([3], dtype=np.int32)))[0])

    assert slope(2.0, 1.0) == pytest.approx(2 * 1.75, rel=1e-12)
    monkeypatch.delattr(jit, "_compiled")
    assert slope(4.0, 5.0) == pytest.approx(10 * 3.5, rel=1e-12)


def test_different_forms_are_told_apart() -> None:
    mesh, x, other = strip(2.0)
    other.x.array[:] = 3.0
    one = fem.Constant(mesh, 1.0)
    forms = {
        x**2 * ufl.dx: 8 / 3,
        x**3 * ufl.dx: 4.0,
        x**2 * ufl.dx(metadata={"quadrature_degree": 0}): 8 / 3 - 4 * 0.5**3 / 12,  # midpoints
        x**2 * ufl.ds: 4.0,
        x * other * ufl.dx: 6.0,
        one * x**2 * other * ufl.dx: 8.0,
        one * x * other**2 * ufl.dx: 18.0,
    }
    for form, value in forms.items():
        assert fem.assemble_scalar(jit.compile_form(form)) == pytest.approx(value, rel=1e-12)


def test_compiled_forms_keep_no_mesh() -> None:
    mesh, x, _ = strip(2.0)
    jit.compile_form(ufl.exp(x) * ufl.dx)
    jit.compile_expression(ufl.exp(x), np.array([[0.5]]))
    freed = weakref.ref(mesh), weakref.ref(x)
    del mesh, x, _
    gc.collect()
    assert [left() for left in freed] == [None, None]
