"""Packages with kinds of mechanism, installed into a folder without a network."""

import shutil
import sys
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import invalidate_caches
from pathlib import Path

from frictionsim.scenario import kinds as plugins
from tests.support.scenarios import ROOT

GROUP = "frictionsim.kinds"  # of the entry points that name kinds
BRAKE = ROOT / "tests" / "plugin" / "frictionsim-brake"
BELT_BLOCK = ROOT / "tests" / "plugin" / "frictionsim-belt-block"


def install(source: Path, target: Path) -> Path:
    """Copy the package of a project, and write the metadata that pip would write of it.

    The folder of the project holds a package of the same name; the target is searched for modules.
    """
    project = tomllib.loads((source / "pyproject.toml").read_text())["project"]
    package = project["name"].replace("-", "_")
    shutil.copytree(
        source / package, target / package, ignore=shutil.ignore_patterns("__pycache__")
    )
    kinds = project["entry-points"][GROUP]
    write_metadata(target, project["name"], kinds, project["version"])
    return target


def write_metadata(target: Path, name: str, kinds: Mapping[str, str], version: str = "1.0") -> None:
    """Write the metadata of an installed package, with the modules of its kinds."""
    folder = target / f"{name.replace('-', '_')}-{version}.dist-info"
    folder.mkdir(parents=True)
    (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    points = "".join(f"{kind} = {module}\n" for kind, module in kinds.items())
    (folder / "entry_points.txt").write_text(f"[{GROUP}]\n{points}")


@contextmanager
def searched(folder: Path) -> Iterator[None]:
    """Let this process find the packages in a folder, and forget them afterwards.

    It remembers the installed kinds, which no user takes away.
    """
    modules = set(sys.modules)
    sys.path.insert(0, str(folder))
    invalidate_caches()
    plugins._installed.cache_clear()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        for name in set(sys.modules) - modules:
            if str(getattr(sys.modules[name], "__file__", "")).startswith(str(folder)):
                del sys.modules[name]
        plugins._installed.cache_clear()
