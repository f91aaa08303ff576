"""Material laws, one module each: every `Law` defined in a module of this folder is available."""

from __future__ import annotations

import functools
import hashlib
import importlib
import pkgutil
from pathlib import Path

from ramiefenics.model.laws.base import Constant, Law, Memory
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.user_file import load_objects

LAWS: dict[str, Law] = {
    value.name: value
    for module in pkgutil.iter_modules(__path__)
    for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values()
    if isinstance(value, Law)
}
"""All laws, by name."""


def law_named(name: str) -> Law:
    """Return the law of a given name, or the one that a Python file defines.

    Raises
    ------
    SpecificationError
        If no law has that name, or the file does not define exactly one law of its own.
    """
    if name in LAWS:
        return LAWS[name]
    if not name.endswith(".py"):
        allowed = f"must be one of {', '.join(LAWS)}, or a Python file that defines a law"
        raise SpecificationError("law", name, allowed)
    return _law_in(name, law_content(name))


def law_content(name: str) -> str:
    """Return what identifies a law: its name, or the checksum of its file if it has one."""
    if name in LAWS or not Path(name).is_file():
        return name
    return hashlib.sha256(Path(name).read_bytes()).hexdigest()


@functools.cache
def _law_in(path: str, content: str) -> Law:
    """Return the law that a file defines; the file is read again when its content changes."""
    found = load_objects(path, Law, "law")
    own = [law for law in found if law not in LAWS.values()]  # the file imports the others
    if len(own) != 1:
        names = ", ".join(law.name for law in own) or "none"
        allowed = f"must define exactly one law of its own, but defines {names}"
        raise SpecificationError("law", path, allowed)
    return own[0]


def check_law(test: BendingTest) -> None:
    """Check that a test's law exists and that it accepts the test's stalk.

    Raises
    ------
    SpecificationError
        If not, with the full dotted name of the field at fault.
    """
    law = law_named(test.law)
    for layer in test.stalk.layers:
        try:
            law.parameters_of(layer.material)
        except SpecificationError as error:
            raise error.inside(f"stalk.layers.{layer.name}.material") from error
    gradient = test.stalk.tissue.radial_gradient
    if gradient != 0.0 and not law.homogeneous:
        allowed = f"must be 0 for the law {law.name}, whose stresses do not scale with the moduli"
        raise SpecificationError("stalk.tissue.radial_gradient", gradient, allowed)


__all__ = ["LAWS", "Constant", "Law", "Memory", "check_law", "law_content", "law_named"]
