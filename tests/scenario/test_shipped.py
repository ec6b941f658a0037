"""The shipped scenarios are found in a source tree and in an installed package."""

import shutil
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS, pulley, python


def test_an_installed_package_has_them_inside(tmp_path: Path) -> None:
    package, ignored = tmp_path / "frictionsim", shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(fs.__file__).parent, package, ignore=ignored)
    for folder in (package, tmp_path):
        shutil.copytree(SCENARIOS, folder / "scenarios")
    program = "import frictionsim as fs\nprint(fs.scenarios()['hard/jump'])"
    done = python("-c", program, cwd=tmp_path, PYTHONPATH=str(tmp_path))
    assert done.stdout == f"{package / 'scenarios' / 'hard' / 'jump.toml'}\n"


def test_they_are_listed_by_name() -> None:
    paths = fs.scenarios()
    assert paths["pulley"] == SCENARIOS / "pulley.toml"
    assert paths["hard/belt_long"] == SCENARIOS / "hard" / "belt_long.toml"
    assert set(paths.values()) == set(SCENARIOS.rglob("*.toml"))
    assert set(fs.kinds()) <= set(paths)


@pytest.mark.parametrize("name", ["pulley", "hard/jump_from_csv"])
def test_they_are_loaded_by_name(name: str, here: Path) -> None:
    by_name, by_path = fs.load(name), fs.load(SCENARIOS / f"{name}.toml")
    assert (by_name, by_name.origin) == (by_path, by_path.origin)
    assert fs.static(name) == fs.static(by_path)


def test_a_file_or_folder_of_that_name_comes_first(here: Path) -> None:
    (here / "pulley").write_text(fs.load(pulley(title="Mine")).to_toml())
    assert fs.load("pulley").title == "Mine"
    (here / "shaft").mkdir()
    with pytest.raises(fs.ScenarioError, match=r"^shaft: cannot read .*: this is a folder"):
        fs.load("shaft")
    # Below another folder there is the file, or none.
    assert fs.load(here / "pulley").title == "Mine"
    with pytest.raises(fs.ScenarioError, match="epicyclic: cannot read this scenario: No such"):
        fs.load(here / "epicyclic")


def test_a_sweep_and_a_study_take_names(here: Path) -> None:
    vary = {"mechanism.load": [2000.0, 2224.1]}
    of_file = fs.sweep(SCENARIOS / "pulley.toml", vary, workers=1)
    assert of_file.identical(fs.sweep("pulley", vary, workers=1))
    study = here / "below" / "study.toml"
    study.parent.mkdir()
    study.write_text('[study]\nscenario = "pulley"\n[vary]\n"mechanism.load" = [2000.0, 2224.1]\n')
    assert of_file.equals(fs.sweep(study, workers=1))
    # A file of that name beside the study comes first.
    (study.parent / "pulley").write_text(fs.load(pulley(title="Mine")).to_toml())
    assert fs.sweep(study, workers=1).attrs["title"] == "Mine"
