"""The shipped scenarios are found in a source tree and in an installed package."""

import shutil
import tomllib
from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario import shipped
from frictionsim.scenario.kinds import KINDS
from frictionsim.scenario.shipped import scenario_file, shipped_folder, shipped_scenarios
from tests.support.scenarios import ROOT, SCENARIOS, pulley


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
    paths = shipped_scenarios()
    assert paths["pulley"] == SCENARIOS / "pulley.toml"
    assert paths["hard/belt_long"] == SCENARIOS / "hard" / "belt_long.toml"
    assert set(paths.values()) == set(SCENARIOS.rglob("*.toml"))
    assert set(KINDS) <= set(paths)


def test_a_wheel_takes_them_along() -> None:
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    assert build["targets"]["wheel"]["force-include"] == {"scenarios": "frictionsim/scenarios"}


@pytest.mark.parametrize("name", ["pulley", "shaft", "hard/jump_from_csv"])
def test_they_are_loaded_by_name(name: str, here: Path) -> None:
    by_name, by_path = fs.load(name), fs.load(SCENARIOS / f"{name}.toml")
    assert (by_name, by_name.origin) == (by_path, by_path.origin)
    assert fs.static(name) == fs.static(by_path)


def test_a_file_or_folder_of_that_name_comes_first(here: Path) -> None:
    (here / "pulley").write_text(fs.load(pulley(title="Mine")).to_toml())
    assert fs.load("pulley").title == "Mine"
    (here / "shaft").mkdir()
    with pytest.raises(ScenarioError, match=r"^shaft: cannot read .*: this is a folder"):
        fs.load("shaft")
    # Below another folder there is the file, or none.
    assert scenario_file("pulley", here) == here / "pulley"
    assert scenario_file(here / "epicyclic") == here / "epicyclic"


def test_a_sweep_and_a_study_take_names(here: Path) -> None:
    vary = {"mechanism.load": [2000.0, 2224.1]}
    of_file = fs.sweep(SCENARIOS / "pulley.toml", vary, workers=1)
    assert of_file.identical(fs.sweep("pulley", vary, workers=1))
    study = here / "below" / "study.toml"
    study.parent.mkdir()
    study.write_text('[study]\nscenario = "pulley"\n[vary]\n"mechanism.load" = [2000.0, 2224.1]\n')
    assert of_file.equals(fs.sweep(study, workers=1))


def test_where_no_scenarios_are_shipped_a_name_is_that_of_a_file(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped, "PACKAGE", here / "without_scenarios")
    for name in ("puley", "counterweight"):
        with pytest.raises(ScenarioError, match=f"^{name}: cannot read this scenario: No such"):
            fs.load(name)
