"""`ramiefenics schema`: what editors know of the files that a user writes."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer


class Kind(StrEnum):
    """Kinds of files."""

    specification = "specification"
    dataset = "dataset"
    study = "study"
    validation = "validation"


def schema_command(
    kind: Annotated[Kind, typer.Argument(help="Of file.")] = Kind.specification,
) -> None:
    """Print the JSON schema of a kind of TOML file, by which editors complete its keys.

    Kept as my.schema.json, it serves a file that begins with the line "#:schema ./my.schema.json"
    in editors with Taplo, Visual Studio Code's Even Better TOML among them.
    """
    from ramiefenics.calibration.study import Study
    from ramiefenics.measured.layout import Layout
    from ramiefenics.specification import BendingTest
    from ramiefenics.specification.schema import schema
    from ramiefenics.validation.study import ValidationStudy

    classes = {
        Kind.specification: (BendingTest, "Specification of a bending test"),
        Kind.dataset: (Layout, "dataset.toml"),
        Kind.study: (Study, "Designed study"),
        Kind.validation: (ValidationStudy, "Validation study"),
    }
    cls, title = classes[kind]
    typer.echo(json.dumps(schema(cls, f"ramiefenics: {title}", ("folder",)), indent=2))
