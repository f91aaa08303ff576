"""An installed package has the files of a clone, and the requirements of its environment."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import jinja2
import pytest
import yaml

from ramiefenics import recipe_names

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]


def extras() -> list[str]:
    """Return the optional dependencies, except references to other optional groups.

    Those of interactive scenes are large, and not in the environment.
    """
    groups = PROJECT["optional-dependencies"].items()
    every = [bound for name, extra in groups if name != "interactive" for bound in extra]
    return [bound for bound in every if not bound.startswith("ramiefenics[")]


def test_environment_has_the_bounds_of_the_project() -> None:
    lines = (ROOT / "environment-pip.txt").read_text().splitlines()
    listed = [line for line in lines if line and not line.startswith("#")]
    assert sorted(listed) == sorted(PROJECT["dependencies"] + extras())
    assert set(PYPROJECT["build-system"]["requires"]) <= set(listed)


def test_conda_recipe_has_the_bounds_of_the_project() -> None:
    """It is rendered as by conda-build, two of whose functions read files beside the recipe."""

    def load_file_regex(path: str, pattern: str, from_recipe_dir: bool) -> re.Match[str] | None:
        return re.search(pattern, (ROOT / "conda" / path).read_text())

    template = jinja2.Template((ROOT / "conda/meta.yaml").read_text())
    recipe = yaml.safe_load(
        template.render(
            PYTHON="python",
            load_file_data=lambda path, from_recipe_dir: tomllib.loads(
                (ROOT / "conda" / path).read_text()
            ),
            load_file_regex=load_file_regex,
        )
    )
    run = recipe["requirements"]["run"]
    wanted = PROJECT["dependencies"] + PROJECT["optional-dependencies"]["plot"]
    assert {bound.removeprefix("python-") for bound in run[2:]} == {w.lower() for w in wanted}
    assert "python-gmsh>=4.11,<5" in run
    assert recipe["requirements"]["host"][-1].replace(" ", "") == "setuptools>=77"
    assert re.fullmatch(r"\d+\.\d+\.\d+", recipe["package"]["version"])
    stated = re.search(r"fenics-dolfinx(\S+)", (ROOT / "pyproject.toml").read_text())
    assert stated is not None
    assert run[1].replace(" ", "") == f"fenics-dolfinx{stated[1]}"


@pytest.mark.slow
def test_wheel_in_an_empty_folder_has_types_and_mesh_recipes(tmp_path: Path) -> None:
    clone, wheels, target = (tmp_path / name for name in ("clone", "wheels", "target"))
    clone.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, clone)
    for name in ("ramiefenics", "meshes"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, clone / name, symlinks=True, ignore=ignored)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--no-input"]
    build = ["wheel", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir"]
    subprocess.run([*pip, *build, wheels, clone], check=True)
    shutil.rmtree(clone)
    (wheel,) = wheels.glob("ramiefenics-*.whl")
    install = ["install", "--no-deps", "--no-index", "--target", target, wheel]
    subprocess.run([*pip, *install], check=True)

    assert (target / "ramiefenics/py.typed").is_file()
    assert (target / "ramiefenics/__init__.pyi").is_file()
    assert not (target / "ramiefenics/meshes").is_symlink()
    told = """
import ramiefenics as rf
print(rf.__file__, *(rf.mesh_recipe(name).name for name in rf.recipe_names()))
assert rf.mesh_recipe("screening").max_force_error > 0.0
"""
    done = subprocess.run(
        [sys.executable, "-c", told],
        env={**os.environ, "PYTHONPATH": str(target)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    where, *recipes = done.stdout.split()
    assert Path(where).is_relative_to(target)
    assert recipes == recipe_names()
