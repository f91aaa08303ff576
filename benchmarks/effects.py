"""The page of effects, from what they say of themselves.

    ./run python benchmarks/effects.py

A second. Writes `docs/effects.md`, with what `effect_signatures.py` has simulated; a test compares
that file with what this would write.
"""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from ramiefenics.effects import EFFECTS, SUSPECTS, Effect
from ramiefenics.effects.combining import exclusions
from ramiefenics.published.stalks import ramie
from ramiefenics.results.text import markdown

PAGE = Path(__file__).resolve().parents[1] / "docs/effects.md"
SIGNATURES = Path(__file__).resolve().parent / "records/effect_signatures.json"

TEXT = """# Effects: what a specification may lack

Real stalks, fixtures and machines have what an idealised test has not. Each such effect is a \
function from specification to specification with an amplitude, whose zero is the specification \
itself:

    ramiefenics effects                 # all of them
    ramiefenics effects pith_core       # physics, reference, amplitude, where it enters
    ramiefenics bend table3 --effect pith_core=0.4 --effect span_error=-8
    ramiefenics bend table3 --effects mine.py --effect worn_indenter=2
    ramiefenics discover DATASET --suspect friction --suspect span_error

`bend` puts them in one after the other, as given, and writes the specification with them to the \
folder of its results. `discover` tries all but {others}, of which a single loading shows \
hardly anything that others do not, and those of `--effects FILE.py`; with `--suspect` the shipped \
ones that are named instead. \
[CONTRIBUTING.md](../CONTRIBUTING.md#add-an-effect) has how to write one.

{effects}
Amplitudes marked with * differ from specimen to specimen; the others are those of a machine, a \
fixture or a batch. Where an effect needs more of the stalk than the quarter model has, the half \
or the full model is chosen, and `bend` says so.

## What each is

{physics}
## What each does to the force

![Change of the force by every effect, in percent of the peak](effects_signatures.png)

Orange: what an effect of typical size does to the force of a mean ramie stalk (diameters of 14.23 \
and 7.28 mm, phloem of 0.67 mm) on the recipe `screening`, as the machine records it. Blue band: \
what other axial and transverse moduli of both layers could do, if each is known to 10 %, at 95 %. \
Dashed: what is left of the signature once these are fitted, by least squares beside errors of 1 % \
of the peak.

## What each can be mistaken for

The table has the root mean square of an effect's signature over 14 mm, and of what a fit of the \
moduli leaves of it, in percent of the peak force; and which effects are alike: beside a fit of \
the moduli their signatures, weighed by prior and errors, are less than 30 degrees apart, for the \
signs that their amplitudes may have. One test like this one tells these from each other only \
where they are large. All angles are below.

{mistaken}
![Angles between the signatures of all effects](effects_angles.png)

## With a second test

Degrees between those that are alike in one test, if the same stalk is tested a second time: on \
another span, under thicker cylinders, turned, a hundred times faster, or unloaded after the first \
loading. `ramiefenics plan` does this for your test and what you know of your stalks.

{second}
## What does not combine

Every pair was applied at typical size to a ramie stalk, in both orders. All others combine.

{excluded}"""


def page() -> str:
    """Return the page."""
    effects = [
        {
            "effect": f"`{effect.name}`",
            "unit": effect.unit,
            "typical": f"{effect.typical:g}{' *' if effect.per_specimen else ''}",
            "bounds": f"{effect.bounds[0]:g} to {effect.bounds[1]:g}",
            "covariates": ", ".join(f"`{key}`" for key in effect.covariates.values()),
            "enters": effect.enters,
        }
        for effect in EFFECTS.values()
    ]
    others = ", ".join(f"`{name}`" for name in EFFECTS if name not in SUSPECTS)
    return TEXT.format(
        others=others,
        effects=markdown(pd.DataFrame(effects)),
        physics="".join(_physics(effect) for effect in EFFECTS.values()),
        mistaken=_mistaken(),
        second=_second(),
        excluded=_excluded(),
    )


def _physics(effect: Effect) -> str:
    companions = " and ".join(map(str, effect.companions))
    comes_with = f" Comes with {companions}." if companions else ""
    return f"- `{effect.name}`: {effect.physics} {effect.reference}.{comes_with}\n"


def _mistaken() -> str:
    """Tell of every effect what its signature is like; of those not simulated yet, that."""
    record = json.loads(SIGNATURES.read_text(encoding="utf-8"))
    rows = []
    for name, effect in EFFECTS.items():
        found = record.get(name, {})
        if found.get("amplitude") != effect.typical:
            found = {"word": "not simulated yet"}
        alike = [f"`{other}` {angle}°" for other, angle in found.get("alike", {}).items()]
        rows.append(
            {
                "effect": f"`{name}`",
                "signature": found.get("rms_percent"),
                "left": found.get("left_percent"),
                "alike": found.get("word") or ", ".join(alike),
            }
        )
    return markdown(pd.DataFrame(rows))


def _second() -> str:
    """Tell of every pair that is alike what a second test makes of its angle."""
    record = json.loads(SIGNATURES.read_text(encoding="utf-8"))
    rows, names = [], list(EFFECTS)
    for name, found in record.items():
        for other, angles in found.get("with_second_test", {}).items():
            if names.index(name) < names.index(other):
                one = {"effects": f"`{name}`, `{other}`", "one test": found["alike"][other]}
                rows.append(one | angles)
    return markdown(pd.DataFrame(rows).astype(object)) if rows else "Not simulated yet.\n"


def _excluded() -> str:
    refused = exclusions(ramie(14.23, 7.28, 0.67), EFFECTS)
    rows = [
        {
            "first": f"`{first}`",
            "second": f"`{second}`",
            "the other order": "no" if (second, first) in refused else "yes",
            "why": why.partition(": ")[2],
        }
        for (first, second), why in refused.items()
    ]
    return markdown(pd.DataFrame(rows)) if rows else "None is refused.\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
