"""The command `effects`, and the options of other commands that name effects."""

from __future__ import annotations

import difflib
import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import Annotated

import typer
from mpi4py import MPI

from ramiefenics.effects import EFFECTS, SUSPECTS, Effect, load_effects
from ramiefenics.effects.combining import exclusions, with_effects
from ramiefenics.published.stalks import ramie
from ramiefenics.specification import BendingTest, SpecificationError

WIDTH = 100
ALL = "all"

EffectFiles = Annotated[
    list[str] | None,
    typer.Option("--effects", metavar="FILE.py", help="Python file with effects of your own."),
]
SweptAmplitudes = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        metavar="NAME=AMPLITUDES",
        help="Effect to add (see ramiefenics effects), with amplitudes to try as for --set; may be "
        "repeated.",
    ),
]
Amplitudes = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        metavar="NAME=AMPLITUDE",
        help="Add an effect (see ramiefenics effects); several are added in the order given.",
    ),
]
SuspectNames = Annotated[
    list[str] | None,
    typer.Option(
        "--suspect",
        metavar="NAME",
        help="A shipped effect to try, or all; by default all but those that a single loading can "
        f"hardly tell from others ({', '.join(sorted(EFFECTS.keys() - SUSPECTS))}). "
        "May be repeated.",
    ),
]
PlannedNames = Annotated[
    list[str] | None,
    typer.Option(
        "--suspect", metavar="NAME", help="A shipped effect; by default all. May be repeated."
    ),
]


def effects_command(
    name: Annotated[
        str | None, typer.Argument(help="Effect to describe; by default all are listed.")
    ] = None,
    files: EffectFiles = None,
) -> None:
    """List the effects of real stalks and machines that can be simulated, or describe one."""
    known = EFFECTS | _of_files(files)
    if name is not None:
        typer.echo(_told(_named(name, known, "effect")))
        return
    for effect in known.values():
        head = f"{effect.name}, typically {effect.typical:g}{_unit(effect)}: "
        typer.echo(textwrap.fill(head + effect.physics, WIDTH, subsequent_indent="    "))


def suspects(
    names: list[str] | None, files: list[str] | None, default: Mapping[str, Effect]
) -> dict[str, Effect]:
    """Return the named shipped effects, or else the default ones, and the user's own.

    The name ``all`` stands for all shipped effects.
    """
    if names and ALL in names:
        return EFFECTS | _of_files(files)
    chosen = {n: _named(n, EFFECTS, "--suspect") for n in names} if names else dict(default)
    return chosen | _of_files(files)


def add_effects(test: BendingTest, given: list[str] | None, files: list[str] | None) -> BendingTest:
    """Return the test with the effects of ``--effect``; report it if they need a larger model.

    Raises
    ------
    SpecificationError
        If an effect is unknown, not of the form name=amplitude, given twice, or makes no sense.
    """
    known = EFFECTS | _of_files(files)
    amplitudes: dict[str, float] = {}
    for assignment in given or []:
        name, _, text = assignment.partition("=")
        effect = _named(name.strip(), known, "--effect")
        if effect.name in amplitudes:
            raise SpecificationError("--effect", assignment, "must not be given twice")
        amplitudes[effect.name] = _amplitude(text, assignment)
    changed = with_effects(test, [(known[name], value) for name, value in amplitudes.items()])
    before, after = test.numerics.domain, changed.numerics.domain
    if before != after and MPI.COMM_WORLD.rank == 0:
        why = f"the effects break the symmetry of the {before} one"
        typer.echo(f"note: the {after} model is used, as {why}", err=True)
    return changed


def swept_effects(
    given: list[str] | None, files: list[str] | None
) -> list[tuple[Effect, Sequence[float]]]:
    """Return the effects of ``--effect`` with all their amplitudes.

    Raises
    ------
    SpecificationError
        If an effect is unknown, or an assignment malformed.
    """
    from ramiefenics.sweep import values_by_key

    known = EFFECTS | _of_files(files)
    assigned = values_by_key(given or [], "--effect")
    return [
        (_named(name, known, "--effect"), [_amplitude(str(v), f"{name}={v}") for v in values])
        for name, values in assigned.items()
    ]


def _of_files(files: list[str] | None) -> dict[str, Effect]:
    found: dict[str, Effect] = {}
    for path in files or []:
        found |= load_effects(path)
    return found


def _named(name: str, known: dict[str, Effect], option: str) -> Effect:
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f", the nearest is {near[0]!r}" if near else ""
        allowed = f"is not an effect{hint}; known: {', '.join(known)}"
        raise SpecificationError(option, name, allowed)
    return known[name]


def _amplitude(text: str, assignment: str) -> float:
    try:
        amplitude = float(text)
    except ValueError:
        amplitude = math.nan
    if not math.isfinite(amplitude):
        raise SpecificationError("--effect", assignment, "must be of the form name=number")
    return amplitude


def _unit(effect: Effect) -> str:
    return "" if effect.unit == "1" else f" {effect.unit}"


def _told(effect: Effect) -> str:
    """Return a complete description of an effect."""
    low, high = effect.bounds
    lines = {
        effect.name: effect.physics,
        "Reference": effect.reference,
        "Amplitude": f"{low:g} to {high:g}{_unit(effect)}, typically {effect.typical:g}"
        + (", different in every specimen" if effect.per_specimen else "")
        + (f"; for a span of {effect.span_mm:g} mm, proportional to it" if effect.span_mm else ""),
        "Enters": effect.enters,
        "Comes with": ", ".join(map(str, effect.companions)),
        "Covariates": ", ".join(effect.covariates.values()),
        "Not with": ", ".join(_excluded(effect)),
    }
    told = [f"{title}: {text}" for title, text in lines.items() if text]
    return "\n".join(textwrap.fill(t, WIDTH, subsequent_indent="    ") for t in told)


def _excluded(effect: Effect) -> list[str]:
    """Return the shipped effects that it cannot be combined with in one order or in both."""
    refused = exclusions(ramie(14.23, 7.28, 0.67), EFFECTS | {effect.name: effect})
    told = []
    for other in EFFECTS:
        after, before = (other, effect.name) in refused, (effect.name, other) in refused
        if after or before:
            told.append(other if after and before else f"{other} {'before' if after else 'after'}")
    return told
