"""Report of verification studies: claims, and a page in Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from ramiefenics.results.manifest import versions
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import markdown
from ramiefenics.verification.study import Study

NAME = "verification"

HEAD = """\
Every claim of the solver, with the command that checks it: `./run ramiefenics verify NAME`, or
`./run ramiefenics verify --out docs` for all of them, which wrote this page. The tests run all
studies, and also check energy, stress and tangent of the laws against finite differences, their
linearisation against the stiffness, and objectivity (`tests/test_laws.py`); jumps
(`tests/test_jump.py`); and two ranks against one (`tests/test_parallel.py`).
[convergence.md](convergence.md) describes how the results depend on mesh and steps. In
[explicit.md](explicit.md) a second solver, with inertia and explicit time steps, checks the whole
curve.
"""
"""Introduction to the page of all studies."""


@dataclass(frozen=True, repr=False)
class Verification(Result):
    """Verification studies that have been run.

    The folder of this result has `verification.md`, and a folder `verification` with everything
    else.

    Attributes
    ----------
    studies
        Studies by name.
    """

    PLACE: ClassVar[str] = NAME

    studies: Mapping[str, Study]

    @property
    def title(self) -> str:
        """Title of the only study; otherwise that of all."""
        titles = [study.title for study in self.studies.values()]
        return titles[0] if len(titles) == 1 else "Verification"

    @property
    def completed(self) -> bool:
        """Whether all claims hold."""
        return all(check.passed for study in self.studies.values() for check in study.checks)

    def findings(self) -> list[str]:
        """Return every claim and whether it holds."""
        return [
            f"{'holds' if check.passed else 'FAILS'}  {study.title}: {check.what} "
            f"{check.value:.6g}, {check.limits}"
            for study in self.studies.values()
            for check in study.checks
        ]

    def claims(self) -> pd.DataFrame:
        """Return a table with one row per claim."""
        return pd.DataFrame(
            [
                {
                    "study": name,
                    "claim": check.what,
                    "found": f"{check.value:.6g}",
                    "allowed": check.limits,
                    "because": check.why,
                    "holds": "yes" if check.passed else "no",
                }
                for name, study in self.studies.items()
                for check in study.checks
            ]
        )

    def numbers(self) -> dict[str, Any]:
        """Return the claims."""
        return {"claims": self.claims().to_dict("records")}

    def tables(self) -> dict[str, Table]:
        """Return the table of claims, and that of every study."""
        own = {n: Table(s.table, s.text) for n, s in self.studies.items() if not s.table.empty}
        return {"claims": Table(self.claims(), "Claims of the solver.")} | own

    def figures(self) -> dict[str, Picture]:
        """Return the plots of all studies that have one."""
        from ramiefenics.verification.figures import plot_figure

        return {
            name: Picture(partial(plot_figure, study.plot), study.title)
            for name, study in self.studies.items()
            if study.plot is not None
        }

    def write_more(self, folder: Path) -> None:
        """Write `verification.md`."""
        (folder / f"{NAME}.md").write_text(self.markdown(), encoding="utf-8")

    def _has_all(self) -> bool:
        """Return whether it has all studies that there are."""
        from ramiefenics.verification import STUDIES  # which imports this file

        return set(self.studies) == set(STUDIES)

    def markdown(self) -> str:
        """Return the page in Markdown."""
        used = ", ".join(f"{package} {version}" for package, version in versions().items())
        links = {n: f"[{n}](#{_anchor(study.title)})" for n, study in self.studies.items()}
        claims = self.claims().replace({"study": links, "holds": {"no": "**no**"}})
        parts = [f"# {self.title}\n"]
        if self._has_all():
            parts.append(HEAD)
        parts += [f"Versions: {used}.\n", markdown(claims)]
        for name, study in self.studies.items():
            if len(self.studies) > 1:
                parts.append(f"## {study.title}\n")
            parts += [f"`./run ramiefenics verify {name}`. {study.text}\n"]
            if study.plot is not None:
                parts.append(f"![{study.title}]({NAME}/{name}.png)\n")
            if not study.table.empty:
                parts.append(markdown(study.table))
        return "\n".join(parts)


def _anchor(title: str) -> str:
    """Return the anchor that GitHub gives to a heading."""
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -")
    return kept.replace(" ", "-")
