"""What is in the files of results: the page of the reference, and the names that tests look up."""

from __future__ import annotations

import pkgutil
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from ramiefenics.specification.explained import attributes

Described = dict[str, dict[str, dict[str, str]]]
"""Meanings of columns and keys, by the class of the result, the file, and the name."""

COMMON = "Every result"

COMMANDS = {
    "BendingResult": "bend",
    "ExplicitResult": "explicit",
    "Sweep": "sweep",
    "Comparison": "compare",
    "Reduction": "reduce",
    "Convergence": "converge",
    "Calibration": "calibrate",
    "Validation": "validate",
    "Discovery": "discover",
    "Plan": "plan",
    "Reconciliation": "reconcile",
    "Verification": "verify",
}
"""Commands that write a result, by its class."""

FIELDS = """\
## Fields for ParaView

`fields/bend.pvd` is the stalk, `fields/contact.pvd` the part of its surface that a cylinder may
touch, and `fields/fixture.pvd` the cylinders. Every file has the values of the curve at its time as
field data. `fields/paraview_state.py` opens all of them.

```{eval-rst}
.. autoclass:: ramiefenics.model.snapshot.Snapshot

.. automethod:: ramiefenics.model.surface.ContactSurface.evaluate
```
"""


def described() -> Described:
    """Return what `results.toml` says, with the attributes of the classes that it names."""
    text = (Path(__file__).parent / "results.toml").read_text(encoding="utf-8")
    return {
        result: {file: _with_attributes(names) for file, names in files.items()}
        for result, files in tomllib.loads(text).items()
    }


def _with_attributes(names: dict[str, str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, meaning in names.items():
        if name == "fields_of":
            found |= attributes(pkgutil.resolve_name(meaning))
        elif name == "without":
            del found[meaning]
        else:
            found[name] = meaning
    return found


def names_in(result: str, file: str) -> list[str]:
    """Return the names that are described of a file of a result; ``ANY`` stands for any text."""
    every, found = described(), list[str]()
    for files in (every[result], every[COMMON]):
        fitting = (names for f, names in files.items() if any(fits(n, file) for n in f.split(", ")))
        found += next(fitting, {})
    return found


def fits(pattern: str, name: str) -> bool:
    """Return whether a pattern, in which ``ANY`` stands for any text, describes a name."""
    return bool(re.fullmatch(re.escape(pattern).replace("ANY", ".+"), name))


def lines() -> Iterator[str]:
    """Yield the lines of the page."""
    yield "# Files of results\n"
    yield "`ANY` stands for a name of your own, for instance that of a factor of a study.\n"
    for result, files in described().items():
        command = COMMANDS.get(result)
        yield f"## `ramiefenics {command}`: {result}\n" if command else f"## {result}\n"
        for file, names in files.items():
            kind = "key" if file.endswith(".json") else "column"
            title = "`, `".join(file.split(", "))
            yield f"### `{title}`\n\n| {kind} | meaning |\n|---|---|"
            for name, meaning in names.items():
                yield f"| `{name}` | {' '.join(meaning.split()).replace('``', '`')} |"
            yield ""
    yield FIELDS
