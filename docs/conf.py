"""How Sphinx makes the documentation: ./run sphinx-build -W docs build/docs."""

from __future__ import annotations

import dataclasses
import inspect
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

from docutils import nodes
from nbconvert import MarkdownExporter
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator
from typer.testing import CliRunner

import ramiefenics
from ramiefenics.cli import app
from ramiefenics.cli.schemas import Kind
from ramiefenics.model.laws import LAWS
from ramiefenics.results.result import Result
from ramiefenics.specification.cylinder import Arrangement
from ramiefenics.specification.explained import Key, keys

sys.path.insert(0, str(Path(__file__).parent))
import results_page
from formulas import mathml

REFERENCE = Path(__file__).resolve().parent / "reference"
PACKAGES = {
    "simulation": ("Simulation", ("solve", "model")),
    "specification_classes": ("Specification, in Python", ("specification",)),
    "measured": ("Measured curves", ("measured", "reduction", "comparison")),
    "studies": (
        "Sweeps, convergence, calibration, validation",
        ("sweep", "convergence", "calibration", "validation", "verification"),
    ),
    "discovery": ("Discovery", ("discovery", "effects")),
    "published": ("The published study", ("published", "reconciliation")),
    "results": ("Results and runs", ("results", "runs")),
}
"""Pages of the Python reference: title, and subpackages of whose public names it tells."""

FURTHER = {
    "simulation": ("model.laws.Law", "model.laws.Constant", "model.laws.Memory"),
    "discovery": ("effects.materials.with_materials",),
    "results": (
        "results.result.Result",
        "results.result.Table",
        "results.result.Picture",
        "runs.mpi_ranks",
    ),
}
"""Names of other modules that the pages tell to import, by page of the Python reference."""

LINKS = {
    "](#add-a-material-law": "](/contributing.md#add-a-material-law",
    "](../CONTRIBUTING.md": "](contributing.md",
    "](../meshes/README.md": "](meshes.md",
    "](CONTRIBUTING.md": "](contributing.md",
    "](CHANGELOG.md": "](changelog.md",
    "](meshes/README.md": "](meshes.md",
    "](docs/examples)": "](reference/examples.md)",
    "](../notebooks/": "](/reference/",
    ".ipynb)": ".md)",
    "](../docs/": "](",
    "](docs/": "](",
}
"""From links between files of the repository to those between pages."""

project = "ramiefenics"
author = copyright = "The ramiefenics developers"
release = version = ramiefenics.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
autodoc_typehints = "none"  # signatures have them; docstrings say what they mean
autodoc_member_order = "bysource"
default_role = "code"
napoleon_use_ivar = True
html_theme = "furo"
html_title = f"ramiefenics {release}"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["tables.css", "formulas.css"]


def write_specification() -> None:
    """Write the page of all keys."""
    lines = [
        "# Keys of a specification",
        "",
        "A specification is a TOML file; tables nest as keys do here, and `NAME` stands for an",
        "entry of a list, by its name. On the command line:",
        "`--set stalk.layers.phloem.material.elastic.E_Z_MPa=1500`.",
        "Units are mm, N, MPa, s and, consistent with these, tonne; a key's name ends in its unit,",
        "and 1 stands for a pure number. Z is along the stalk, Y up, X across, and index 3 is Z.",
        "Indenters move along -Y. Symbols are those of [](../model.md#laws). A key that is",
        "required cannot be left out; one whose default is to be left out has no value then.",
        "`ramiefenics new my_test.toml` writes a specification with all of this in it.",
        "",
    ]
    told = {key.path: key for key in keys()}
    tables = {path for path, key in told.items() if not key.type} | {""}
    for table in sorted(tables, key=["", *told].index):
        if table:
            lines += [f"## `{table}`", "", _text(told[table].meaning), ""]
        inside = [
            key
            for key in told.values()
            if key.type and key.path.rpartition(".")[0].removesuffix(".NAME") == table
        ]
        if inside:
            lines += [
                "| key | symbol | type | unit | default | meaning |",
                "|---|---|---|---|---|---|",
            ]
        lines += [_row(key) for key in inside]
        lines.append("")
    lines += [
        "## Constants of laws",
        "",
        "They are keys of `stalk.layers.NAME.material.law_constants`;",
    ]
    lines += ["[](../model.md#history-dependent-laws) says what they mean.", ""]
    lines += ["| law | key | unit | default |", "|---|---|---|---|"]
    for law in LAWS.values():
        for constant in law.constants:
            default = "required" if constant.default is None else f"`{constant.default:g}`"
            lines.append(f"| `{law.name}` | `{constant.name}` | {constant.unit} | {default} |")
    lines.append("")
    (REFERENCE / "specification.md").write_text("\n".join(lines), encoding="utf-8")


def _row(key: Key) -> str:
    """Return the row of a key in the table of its page."""
    default = "required" if key.required else f"`{key.default}`" if key.default else "left out"
    symbol = f"`{key.symbol}`" if key.symbol else ""
    first = f"| `{key.path.rpartition('.')[2]}` | {symbol} | {key.type} | {key.unit} | "
    return f"{first}{default} | {_text(key.meaning)} |"


def _text(docstring: str) -> str:
    """Return text of a docstring as Markdown in a table."""
    return docstring.replace("``", "`").replace("|", "\\|")


def write_python() -> None:
    """Write the pages of all public names."""
    pages: dict[str, list[str]] = {page: [] for page in PACKAGES}
    for name in sorted(ramiefenics.__all__, key=str.lower):
        thing = getattr(ramiefenics, name)
        module = getattr(thing, "__module__", "")
        package = module.split(".")[1] if module.startswith("ramiefenics.") else "effects"
        page = next(page for page, (_, packages) in PACKAGES.items() if package in packages)
        pages[page] += _entry(name, thing)
    for page, names in FURTHER.items():
        for name in names:
            path = f"ramiefenics.{name}"
            pages[page] += _entry(path, pkgutil.resolve_name(path))
    for page, (title, _) in PACKAGES.items():
        body = "\n".join(pages[page])
        text = f"# {title}\n\n```{{eval-rst}}\n.. currentmodule:: ramiefenics\n\n{body}\n```\n"
        (REFERENCE / f"{page}.md").write_text(text, encoding="utf-8")


def _entry(name: str, thing: object) -> list[str]:
    if inspect.isclass(thing):
        members = (
            "" if dataclasses.is_dataclass(thing) and not _methods(thing) else "   :members:\n"
        )
        if issubclass(thing, (Result, Arrangement)):
            members += "   :inherited-members:\n"
        return [f".. autoclass:: {name}\n{members}"]
    if callable(thing):
        return [f".. autofunction:: {name}\n"]
    return [f".. py:data:: {name}\n\n   In ``ramiefenics.effects``; by name.\n"]


def _methods(thing: type) -> bool:
    return any(not name.startswith("_") for name, _ in inspect.getmembers(thing, callable))


def write_commands() -> None:
    """Write the page of the command line."""
    command = [sys.executable, "-m", "typer", "ramiefenics.cli", "utils", "docs"]
    command += ["--name", "ramiefenics", "--title", "Commands"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (REFERENCE / "commands.md").write_text(done.stdout, encoding="utf-8")


def write_examples() -> None:
    """Write the page of example specifications."""
    lines = ["# Example specifications", ""]
    for path in sorted((REFERENCE.parent / "examples").glob("*.toml")):
        lines += [f"## {path.stem.replace('_', ' ').capitalize()}", ""]
        lines += [f"```{{literalinclude}} ../examples/{path.name}", ":language: toml", "```", ""]
    (REFERENCE / "examples.md").write_text("\n".join(lines), encoding="utf-8")


def write_files() -> None:
    """Write the page of what is in the files of results."""
    (REFERENCE / "files.md").write_text("\n".join(results_page.lines()), encoding="utf-8")


def write_schemas() -> None:
    """Write the page of JSON schemas, and the schemas."""
    lines = [
        "# JSON schemas",
        "",
        "With these, editors complete the keys of the TOML files that you",
    ]
    lines += ["write, show their meanings, and mark unknown ones. `ramiefenics schema KIND` prints"]
    lines += ["them. Save one as `my.schema.json`, and begin the TOML file with the line"]
    lines += ["`#:schema ./my.schema.json`, which editors with Taplo understand.", ""]
    for kind in Kind:
        file = f"{kind}.schema.json"
        told = CliRunner().invoke(app, ["schema", kind]).stdout
        (REFERENCE / file).write_text(told, encoding="utf-8")
        lines += [f"## {kind.capitalize()}", "", f"{{download}}`{file}`", ""]
        lines += [f"```{{literalinclude}} {file}", ":language: json", "```", ""]
    (REFERENCE / "schemas.md").write_text("\n".join(lines), encoding="utf-8")


def write_gallery() -> None:
    """Write the page of figures with what makes them."""
    lines = ["# Gallery", "", "Each figure with all that makes it.", ""]
    for path in sorted((REFERENCE.parent / "gallery").glob("[0-9]*.py")):
        title, _, code = path.read_text(encoding="utf-8").partition("\n\n")
        title = title.strip('"')
        lines += [f"## {title.rstrip('.')}", "", f"![{title}](../gallery/{path.stem}.png)", ""]
        lines += ["```python", code.strip(), "```", ""]
    (REFERENCE / "gallery.md").write_text("\n".join(lines), encoding="utf-8")


def write_notebooks() -> None:
    """Write a page of every notebook, with its stored outputs."""
    pages = []
    for path in sorted((REFERENCE.parents[1] / "notebooks").glob("*.ipynb")):
        text, extras = MarkdownExporter().from_filename(str(path))
        for name, content in extras["outputs"].items():
            text = text.replace(name, f"{path.stem}_{name}")
            (REFERENCE / f"{path.stem}_{name}").write_bytes(content)
        (REFERENCE / f"{path.stem}.md").write_text(_within_pages(text), encoding="utf-8")
        pages.append(path.stem)
    lines = ["# Notebooks", "", "They are in `notebooks`, to be run and changed.", ""]
    lines += ["```{toctree}", *pages, "```", ""]
    (REFERENCE / "notebooks.md").write_text("\n".join(lines), encoding="utf-8")


def _within_pages(text: str) -> str:
    """Return a notebook's text with colours of terminals left out, and links to pages one up."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", text)
    return text.replace("](../docs/", "](../").replace("](../meshes/README.md", "](../meshes.md")


def between_pages(text: str) -> str:
    """Return Markdown of the repository with links between pages, which have their titles."""
    for link, other in LINKS.items():
        text = text.replace(link, other)
    return re.sub(r"\[[\w./]+\.md\]\(", "[](", text)


def write_formula(page: HTML5Translator, formula: nodes.math | nodes.math_block) -> None:
    """Write a formula as MathML."""
    page.body.append(mathml(formula.astext(), isinstance(formula, nodes.math_block)))
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Have links rewritten in what is read, and formulas written as MathML."""
    app.add_html_math_renderer("mathml", (write_formula, None), (write_formula, None))

    def rewrite(*event: list[str]) -> None:
        event[-1][0] = between_pages(event[-1][0])  # the text is the last that both events tell

    app.connect("source-read", rewrite)
    app.connect("include-read", rewrite)


REFERENCE.mkdir(exist_ok=True)
for write in (
    write_specification,
    write_python,
    write_commands,
    write_examples,
    write_files,
    write_schemas,
    write_gallery,
    write_notebooks,
):
    write()
