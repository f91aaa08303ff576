"""Compiled C code, built once on a machine and kept beside the compiled forms."""

from __future__ import annotations

import fcntl
import functools
import hashlib
import importlib.util
import sysconfig
import tempfile
from pathlib import Path
from types import ModuleType

import cffi

from ramiefenics.model.jit import CACHE, JIT_OPTIONS
from ramiefenics.model.seal import is_sound, seal

FOLDER = CACHE.parent / "kernels"


@functools.cache
def compiled(source: str, declarations: str, libraries: tuple[str, ...] = ()) -> ModuleType:
    """Compile C code, or take it from the cache; return cffi's module.

    Parameters
    ----------
    source
        The code.
    declarations
        Declarations of what is called from Python.
    libraries
        Libraries to link with.

    Raises
    ------
    cffi.VerificationError
        If the code cannot be compiled.
    """
    # with this macro math.h offers its functions for vectors; GCC itself defines the macro only
    # where NaN need not be preserved
    options = [*JIT_OPTIONS["cffi_extra_compile_args"], "-D__FAST_MATH__"]
    key = "\n".join((source, declarations, *options, *libraries, cffi.__version__))
    name = f"kernel_{hashlib.sha256(key.encode()).hexdigest()[:24]}"
    FOLDER.mkdir(parents=True, exist_ok=True)
    target = FOLDER / f"{name}{sysconfig.get_config_var('EXT_SUFFIX')}"
    # a lock is released when its process ends, however that happens
    with (FOLDER / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not is_sound(target):
            _build(target, source, declarations, options, ("m", *libraries))
            seal(target)
    specification = importlib.util.spec_from_file_location(name, target)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def _build(
    target: Path, source: str, declarations: str, options: list[str], libraries: tuple[str, ...]
) -> None:
    with tempfile.TemporaryDirectory(dir=FOLDER) as folder:
        builder = cffi.FFI()
        builder.cdef(declarations)
        name = target.name.partition(".")[0]
        builder.set_source(name, source, extra_compile_args=options, libraries=list(libraries))
        Path(builder.compile(tmpdir=folder)).rename(target)
