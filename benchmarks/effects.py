"""The page of effects, from what they say of themselves.

    ./run python benchmarks/effects.py

A second. Writes `docs/effects.md`; a test compares that file with what this would write.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ramiefenics.effects import EFFECTS, SUSPECTS, Effect
from ramiefenics.effects.combining import exclusions
from ramiefenics.published.stalks import ramie
from ramiefenics.results.text import markdown

PAGE = Path(__file__).resolve().parents[1] / "docs/effects.md"

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
folder of its results. `discover` tries {suspects}, and those of `--effects FILE.py`; with \
`--suspect` the shipped ones that are named instead. \
[CONTRIBUTING.md](../CONTRIBUTING.md#add-an-effect) has how to write one.

{effects}
Amplitudes marked with * differ from specimen to specimen; the others are those of a machine, a \
fixture or a batch. Where an effect needs more of the stalk than the quarter model has, the half \
or the full model is chosen, and `bend` says so.

## What each is

{physics}
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
    suspects = ", ".join(f"`{name}`" for name in SUSPECTS)
    return TEXT.format(
        suspects=suspects,
        effects=markdown(pd.DataFrame(effects)),
        physics="".join(_physics(effect) for effect in EFFECTS.values()),
        excluded=_excluded(),
    )


def _physics(effect: Effect) -> str:
    companions = " and ".join(map(str, effect.companions))
    comes_with = f" Comes with {companions}." if companions else ""
    return f"- `{effect.name}`: {effect.physics} {effect.reference}.{comes_with}\n"


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
