"""`ramiefenics schema`: JSON schemas, for editors, of the files that a user writes."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer


class Kind(StrEnum):
    """Kind of TOML file."""

    specification = "specification"
    dataset = "dataset"
    study = "study"
    validation = "validation"


def schema_command(
    kind: Annotated[Kind, typer.Argument(help="Kind of file.")] = Kind.specification,
) -> None:
    """Print the JSON schema of a kind of TOML file, with which editors complete its keys.

    Save it as my.schema.json, and begin the TOML file with the line "#:schema ./my.schema.json".
    This works in editors with Taplo, such as Visual Studio Code with Even Better TOML.
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
