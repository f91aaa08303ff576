"""JSON schemas accept readable files and refuse others, according to an independent validator."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from typer.testing import CliRunner

import ramiefenics as rf
from ramiefenics.calibration import study
from ramiefenics.cli import app
from ramiefenics.specification.files import to_dict
from ramiefenics.validation import study as validation_study

ROOT = Path(__file__).parents[1]


def validator(kind: str) -> jsonschema.Draft202012Validator:
    done = CliRunner().invoke(app, ["schema", kind])
    assert done.exit_code == 0
    told = json.loads(done.stdout)
    jsonschema.Draft202012Validator.check_schema(told)
    return jsonschema.Draft202012Validator(told)


def read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def test_specifications_are_accepted() -> None:
    check = validator("specification")
    check.validate(to_dict(rf.ramie(14.0, 7.0, 0.6)))
    examples = sorted((ROOT / "docs" / "examples").glob("*.toml"))
    assert examples
    for path in examples:
        check.validate(read(path))


@pytest.mark.parametrize(
    ("kind", "folder"), [("study", study.STUDIES), ("validation", validation_study.STUDIES)]
)
def test_shipped_studies_are_accepted(kind: str, folder: Path) -> None:
    check, paths = validator(kind), sorted(folder.glob("*.toml"))
    assert paths
    for path in paths:
        check.validate(read(path))


def test_a_layout_is_accepted() -> None:
    layout = (ROOT / "docs" / "discovery.md").read_text().partition("```toml\n")[2]
    validator("dataset").validate(tomllib.loads(layout.partition("```")[0]))


@pytest.mark.parametrize(
    "change",
    [
        {"stalk": 5},
        {"spam": 1},
        {"law": 3},
        {"protocol": {"travel_mm": "far"}},
        {"protocol": {"travel_cm": 1.0}},
        {"numerics": {"mesh": "no such recipe"}},
        {"numerics": {"stepping": {"max_iterations": 2.5}}},
    ],
)
def test_what_is_not_read_is_refused(change: dict[str, Any]) -> None:
    test = to_dict(rf.ramie(14.0, 7.0, 0.6)) | change
    with pytest.raises(jsonschema.ValidationError):
        validator("specification").validate(test)
    with pytest.raises(rf.SpecificationError):
        rf.as_test(rf.ramie(14.0, 7.0, 0.6), **change)


def test_keys_are_explained() -> None:
    told = validator("specification").schema["$defs"]["Protocol"]["properties"]["travel_mm"]
    assert told["type"] == "number"
    assert told["description"].startswith("Travel of the indenter")
