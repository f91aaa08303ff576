"""Documentation page of the effects, generated from their definitions.

    ./run python benchmarks/effects.py

Takes a second. Writes `docs/effects.md`, including the results of `effect_signatures.py`. A test
compares that file with what this script would write.
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

Real stalks, fixtures and machines differ from an idealised test. Each such difference, an effect, \
is a function from specification to specification. It has an amplitude, and at amplitude zero it \
leaves the specification as it is:

    ramiefenics effects                 # all of them
    ramiefenics effects pith_core       # physics, reference, amplitude, where it enters
    ramiefenics bend table3 --effect pith_core=0.4 --effect span_error=-8
    ramiefenics bend table3 --effects mine.py --effect worn_indenter=2
    ramiefenics discover DATASET --suspect friction --suspect span_error

`bend` applies the effects in the order in which they are given, and writes the resulting \
specification to the folder of its results. `discover` tries all effects except {others}, which a \
single loading can hardly distinguish from others, and tries those of `--effects FILE.py` as well. \
With `--suspect` it tries only the shipped effects that are named. \
[CONTRIBUTING.md](../CONTRIBUTING.md#add-an-effect) describes how to write one.

{effects}
Amplitudes marked with * differ from specimen to specimen. The others belong to a machine, a \
fixture or a batch of stalks and are the same for all specimens. If an effect breaks a symmetry of \
the quarter model, the half or the full model is used instead, and `bend` says so.

## The physics of each effect

{physics}
## How each changes the force

![Change of the force by every effect, in percent of the peak](effects_signatures.png)

Orange: change of the recorded force caused by an effect of typical size, its signature, for a \
mean ramie stalk (diameters of 14.23 and 7.28 mm, phloem of 0.67 mm) on the recipe `screening`. \
Blue band: changes that the axial and transverse moduli of both layers could cause if each is \
known to 10 % (95 % band). Dashed: the part of the signature that remains after these moduli have \
been fitted by least squares, with errors of 1 % of the peak.

## What each can be mistaken for

The table gives the root mean square of each signature over 14 mm of travel, and of the part of it \
that remains after a fit of the moduli, in per cent of the peak force. It also lists the effects \
that are alike. Two effects are called alike if the angle between their signatures, after the fit \
of the moduli and weighted by prior and errors, is less than 30 degrees for the signs that their \
amplitudes may have. A single test of this kind distinguishes them only if they are large. The \
figure below the table gives the angles between all effects.

{mistaken}
![Angles between the signatures of all effects](effects_angles.png)

## With a second test

Effects that are alike in one test may differ in a second test of the same stalk. The table gives \
the angle between their signatures, in degrees, if the second test is made on another span, with \
thicker cylinders, with the stalk turned, a hundred times faster, or with unloading after the \
first loading. `ramiefenics plan` computes this for your own test and your own knowledge of the \
stalks.

{second}
## What does not combine

Every pair of effects was applied at typical size to a ramie stalk, in both orders. The pairs in \
the table cannot be combined; all others can.

{excluded}"""


def page() -> str:
    """Return the page, in Markdown."""
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
    """Return the table of the effects' signatures; it marks those that are not simulated yet."""
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
    """Return the table of the angles of all similar pairs in one test and with a second one."""
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
