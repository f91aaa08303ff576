"""Output of the commands, and the options that all commands share."""

from __future__ import annotations

import functools
import inspect
import json
import logging
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec

import typer
from mpi4py import MPI

import ramiefenics
from ramiefenics.diagnostics import show_log

if TYPE_CHECKING:
    from ramiefenics.results.result import Result

P = ParamSpec("P")

log = logging.getLogger(__name__)

LEVELS = (logging.NOTSET, logging.INFO, logging.DEBUG)
"""Log levels to show, by the number of times that -v is given."""

Verbosity = Annotated[
    int,
    typer.Option(
        "--verbose",
        "-v",
        count=True,
        show_default=False,
        metavar="",
        help="Log the steps to standard error; -vv: also residuals, and the origin of refusals.",
    ),
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print errors only: no progress, notes or text.")
]
Json = Annotated[
    bool, typer.Option("--json", help="Print the summary as JSON instead of the text.")
]


@dataclass
class Output:
    """Settings of a command's output.

    Attributes
    ----------
    quiet
        Whether to print errors only.
    json
        Whether to print results as JSON.
    """

    quiet: bool = False
    json: bool = False

    def tell(self, found: Result, folder: Path) -> None:
        """Print a result, and the folder in which it is."""
        if self.json:
            typer.echo(json.dumps(found.summary(), indent=2))
        elif not self.quiet:
            typer.echo(found)
        if not self.quiet:
            typer.echo(f"results in {folder}", err=self.json)


output = Output()
"""Output settings of the command that this process runs."""


def with_options(command: Callable[P, None], result: bool = True) -> Callable[..., None]:
    """Add the options -v and --quiet to a command, and --json if it has a result."""

    @functools.wraps(command)
    def told(*args: Any, verbose: int, quiet: bool, **kwargs: Any) -> None:
        output.quiet, output.json = quiet, kwargs.pop("as_json", False)
        if MPI.COMM_WORLD.rank == 0:
            show_log(LEVELS[min(verbose, len(LEVELS) - 1)])
        log.info("ramiefenics %s: %s", ramiefenics.__version__, " ".join(sys.argv[1:]))
        command(*args, **kwargs)

    options: dict[str, tuple[object, object]] = {"verbose": (0, Verbosity), "quiet": (False, Quiet)}
    if result:
        options["as_json"] = (False, Json)
    return with_parameters(told, command, options)


def with_parameters(
    function: Callable[..., None],
    command: Callable[..., None],
    options: Mapping[str, tuple[object, object]],
    without: str = "",
) -> Callable[..., None]:
    """Give a function the parameters of a command, except one, and additional options.

    Parameters
    ----------
    function, command
        The function that Typer calls, and the command that it wraps.
    options
        Defaults and annotations of the additional options, by name.
    without
        Name of the parameter that is left out.
    """
    signature = inspect.signature(command, eval_str=True)
    more = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, (default, kind) in options.items()
    ]
    parameters = [p for p in signature.parameters.values() if p.name != without] + more
    function.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    function.__annotations__ = {p.name: p.annotation for p in parameters}
    return function
