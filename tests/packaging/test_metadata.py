"""Metadata of the package: its dependencies and its citation."""

import ast
import re
import sys
import tomllib

from frictionsim import __version__
from tests.support.scenarios import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

OPTIONAL = {"distributed"}  # imported when it is asked for, and its absence is told

DISTRIBUTIONS = {"PIL": "pillow"}  # by the names of their modules


def imported() -> set[str]:
    """Return the libraries that a module of the package imports, at its top or in a function.

    pydantic_core is a part of pydantic, which asks for the one version that fits.
    """
    packages: set[str] = set()
    for path in (ROOT / "frictionsim").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                packages |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                packages.add(str(node.module).split(".")[0])
    packages -= set(sys.stdlib_module_names) | {"frictionsim", "pydantic_core"}
    return {DISTRIBUTIONS.get(name, name) for name in packages}


def names(requirements: list[str]) -> set[str]:
    return {re.split(r"[\[<>=]", text)[0].replace("-", "_") for text in requirements}


def test_a_plain_install_has_all_that_the_package_imports() -> None:
    used = imported()
    assert "numpy" in used
    assert used - OPTIONAL <= names(PROJECT["dependencies"])
    extras = [extra for extras in PROJECT["optional-dependencies"].values() for extra in extras]
    assert names(extras) >= OPTIONAL
    # xarray reads results with h5netcdf, which nothing imports by its name.
    assert {"xarray", "h5netcdf"} <= names(PROJECT["dependencies"])


def test_the_citation_has_the_version() -> None:
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    assert f"version: {__version__}" in lines


def test_the_citation_and_the_changelog_agree_on_releases() -> None:
    """A version is released where the changelog has a heading with its date, on that date."""
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    dated = re.findall(r"^## \[?([\d.]+)\]?\D+(\d{4}-\d\d-\d\d)$", changelog, re.MULTILINE)
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    dates = re.findall(r"^date-released: (\S+)$", citation, re.MULTILINE)
    assert dates == [date for version, date in dated if version == __version__]
    assert dated or "\n## Unreleased\n" in changelog
