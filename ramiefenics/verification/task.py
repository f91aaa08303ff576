"""Verification studies as tasks, several at a time and resumable."""

from __future__ import annotations

import dataclasses
import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ramiefenics.runs import key_of
from ramiefenics.specification import SpecificationWarning
from ramiefenics.verification.study import Check, Plot, Series, Study


@dataclass(frozen=True)
class StudyTask:
    """Task that carries out a study.

    Attributes
    ----------
    name
        Name of the study, see `STUDIES`.
    """

    name: str

    def keys(self) -> tuple[str, ...]:
        """Return the key under which the study is kept."""
        files = sorted(str(path) for path in Path(__file__).parent.rglob("*.*"))
        return (key_of(self.name, *(f for f in files if "__pycache__" not in f)),)

    def compute(self) -> str:
        """Carry out the study; return it as JSON."""
        from ramiefenics.verification import STUDIES  # which imports this file

        with warnings.catch_warnings(action="ignore", category=SpecificationWarning):
            return json.dumps(dataclasses.asdict(STUDIES[self.name]()), default=_plain)

    def read(self, text: str) -> Study:
        """Return the study that a kept text describes."""
        content = json.loads(text)
        plot = content["plot"]
        if plot is not None:
            plot = Plot(**plot | {"series": tuple(Series(**one) for one in plot["series"])})
        checks = tuple(Check(**check) for check in content["checks"])
        table = pd.DataFrame(content["table"])
        return Study(content["title"], content["text"], checks, table, plot)


def _plain(value: Any) -> Any:
    """Return a table, an array or a number of NumPy in the types of JSON."""
    if isinstance(value, pd.DataFrame):
        return value.to_dict("list")
    if isinstance(value, (pd.Series, np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{type(value)} in a study")
