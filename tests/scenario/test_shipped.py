"""The shipped scenarios are found in a source tree and in an installed package."""

import shutil
import tomllib
from pathlib import Path

import pytest

from frictionsim.errors import InputError
from frictionsim.scenario import shipped
from frictionsim.scenario.kinds import KINDS
from frictionsim.scenario.shipped import shipped_folder, shipped_scenarios
from tests.support.scenarios import ROOT, SCENARIOS

pytestmark = pytest.mark.quick


def test_a_source_tree_has_them_beside_the_package() -> None:
    assert shipped_folder() == SCENARIOS


def test_an_installed_package_has_them_inside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "site-packages" / "frictionsim"
    shutil.copytree(SCENARIOS, package / "scenarios")
    shutil.copytree(SCENARIOS, package.parent / "scenarios")
    monkeypatch.setattr(shipped, "PACKAGE", package)
    assert shipped_folder() == package / "scenarios"
    assert shipped_scenarios()["hard/jump"] == package / "scenarios" / "hard" / "jump.toml"


def test_scenarios_of_another_package_are_not_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "city.toml").touch()
    monkeypatch.setattr(shipped, "PACKAGE", tmp_path / "frictionsim")
    with pytest.raises(InputError, match=r"are neither in .*frictionsim.scenarios nor in .*again"):
        shipped_scenarios()


def test_they_are_listed_by_name() -> None:
    found = shipped_scenarios()
    assert found["pulley"] == SCENARIOS / "pulley.toml"
    assert found["hard/belt_long"] == SCENARIOS / "hard" / "belt_long.toml"
    assert set(found.values()) == set(SCENARIOS.rglob("*.toml"))
    assert set(KINDS) <= set(found)


def test_a_wheel_takes_them_along() -> None:
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    assert build["targets"]["wheel"]["force-include"] == {"scenarios": "frictionsim/scenarios"}
