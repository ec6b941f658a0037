"""`load`: what it takes, what it refuses and how it says so; what a Scenario can do."""

import copy
import pickle
import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pydantic
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from tests.support.drawn_scenarios import gears, marble_machines, pulleys
from tests.support.scenarios import SCENARIOS, pulley

PULLEY = SCENARIOS / "pulley.toml"
# Without an interval between samples: it depends on the duration then.
PLAIN = pulley(output=None)
MU_S = "effects.shaft_friction.mu_s"


def test_a_path_a_text_and_a_dict_give_the_same_scenario() -> None:
    by_path = fs.load(PULLEY)
    assert fs.load(str(PULLEY)) == by_path
    assert fs.load(tomllib.loads(PULLEY.read_text(encoding="utf-8"))) == by_path
    assert fs.loads(PULLEY.read_text(encoding="utf-8")) == by_path
    origins = [loaded.origin for loaded in (by_path, fs.load(pulley()))]
    assert [(one.source, one.overrides) for one in origins] == [(str(PULLEY), ()), ("", ())]
    assert (by_path.kind, by_path.title) == ("pulley", "Pulley on a dry shaft")


def test_a_dict_may_have_arrays_tuples_and_any_mapping() -> None:
    force = {"time": np.array([0.0, 0.8]), "value": (np.float32(1832.5), np.int64(3000))}
    data: dict[str, Any] = {
        **pulley(),
        "drive": MappingProxyType({"force": force}),
        "solver": {"duration": np.float64(2.0), "max_steps": np.int32(1000)},
        "output": {"at_events": np.bool_(False)},
    }
    plain = {
        **pulley(),
        "drive": {"force": {"time": [0.0, 0.8], "value": [1832.5, 3000]}},
        "solver": {"duration": 2.0, "max_steps": 1000},
        "output": {"at_events": False},
    }
    assert fs.load(data) == fs.load(plain)
    tomllib.loads(fs.load(data).to_toml())


def test_a_dict_is_not_changed() -> None:
    data = pulley()
    fs.load(data, {MU_S: 0.3, "output.at_events": False})
    fs.solve(data, {MU_S: 0.3})
    assert data == pulley()


@pytest.mark.parametrize(
    "overrides",
    [
        {MU_S: 0.3, "title": "a 'b' \"c\""},
        {MU_S: np.float64(0.3), "title": "a 'b' \"c\""},
        [f"{MU_S}=0.3", 'title="a \'b\' \\"c\\""'],
        (f"{MU_S}={value}" if value else 'title="a \'b\' \\"c\\""' for value in (0.3, None)),
    ],
    ids=["mapping", "numpy", "texts", "generator"],
)
def test_overrides_are_a_mapping_or_texts(overrides: Any) -> None:
    scenario = fs.load(PULLEY, overrides)
    assert scenario.to_dict()["effects"]["shaft_friction"]["mu_s"] == 0.3
    assert scenario.title == "a 'b' \"c\""
    assert scenario.origin.source == str(PULLEY)
    # The command solves the same scenario again.
    assert fs.load(PULLEY, scenario.origin.overrides) == scenario


@pytest.mark.parametrize("title", ["smile \U0001f600", "\x85 and \u2028", "tab \\t", "é"])
def test_any_title_is_kept_in_overrides_and_files(title: str, tmp_path: Path) -> None:
    scenario = fs.load(PLAIN, {"title": title, "solver.duration": 0.1})
    assert fs.load(PLAIN, scenario.origin.overrides) == scenario
    result = fs.open(fs.solve(scenario).save(tmp_path / "a.h5"))
    assert result.scenario.title == title
    assert result.scenario.origin.overrides == scenario.origin.overrides


def test_an_override_of_several_lines_is_kept_in_one() -> None:
    overrides = ["drive.force.value=[1832.6, # at rest\n 3000.0]"]
    scenario = fs.load(PULLEY, overrides)
    assert scenario.origin.overrides == ("drive.force.value=[1832.6, 3000.0]",)


def with_csv(folder: Path) -> None:
    folder.mkdir()
    (folder / "force.csv").write_text("0,1832.6\n0.8,3000\n")
    text = PULLEY.read_text(encoding="utf-8")
    begin, end = text.index("force ="), text.index("direction")
    (folder / "s.toml").write_text(text[:begin] + 'force = {csv = "force.csv"}\n' + text[end:])


def test_files_are_relative_to_the_scenario_or_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_csv(tmp_path / "a")
    scenario = fs.load(tmp_path / "a" / "s.toml")
    assert scenario.to_dict()["drive"]["force"]["value"] == (1832.6, 3000.0)
    override = {"drive.force": {"csv": Path("force.csv")}}
    assert fs.load(tmp_path / "a" / "s.toml", override) == scenario
    assert scenario.replace(override) == scenario
    with pytest.raises(fs.ScenarioError, match=r"force\.csv"):
        fs.load(PLAIN, override)
    monkeypatch.chdir(tmp_path / "a")
    assert fs.load(PLAIN, override).to_dict()["drive"] == scenario.to_dict()["drive"]


REPLACED: Mapping[str, Any] = {
    "duration": {"solver.duration": 20.0},
    "friction": {MU_S: 0.3, "effects.shaft_friction.mu_k": 0.2},
    "law": {"effects.shaft_friction.law": "regularised", "solver.backend": "rkf45"},
    "interval": {"output.interval": 0.25},
    "table": {"effects": {}},
    "text": ["solver.rtol=1e-5", "title=short"],
}


@pytest.mark.parametrize("source", [PULLEY, PLAIN], ids=["path", "dict"])
@pytest.mark.parametrize("name", REPLACED)
def test_replace_gives_what_load_gives(name: str, source: Any) -> None:
    overrides = REPLACED[name]
    loaded, replaced = fs.load(source, overrides), fs.load(source).replace(overrides)
    assert replaced == loaded
    assert replaced.origin == loaded.origin
    assert replaced.to_toml() == loaded.to_toml()
    # What was left out stays left out.
    assert replaced.model_fields_set == loaded.model_fields_set
    assert replaced.solver.model_fields_set == loaded.solver.model_fields_set
    assert fs.load(source).replace(overrides=overrides) == loaded


def test_replace_adds_to_the_overrides_and_leaves_the_scenario() -> None:
    scenario = fs.load(PULLEY, {MU_S: 0.3})
    longer = scenario.replace({"solver.duration": 9.0}, title="longer")
    assert longer.origin.overrides == (f"{MU_S}=0.3", "solver.duration=9.0", "title=longer")
    assert fs.load(PULLEY, longer.origin.overrides) == longer
    assert (scenario.solver.duration, scenario.title) == (3.0, "Pulley on a dry shaft")
    assert scenario.replace() == scenario


@given(data=st.one_of(pulleys(), marble_machines(), gears()))
def test_a_scenario_survives_its_tables_and_toml(data: dict[str, Any]) -> None:
    scenario = fs.load(data)
    # The interval depends on the duration; the tables have its value.
    whole = scenario.replace({"output.interval": scenario.interval})
    assert fs.load(scenario.to_dict()) == whole
    assert fs.loads(scenario.to_toml()) == whole
    assert hash(fs.load(scenario.to_dict())) == hash(whole)
    assert fs.load(whole.to_dict()).to_toml() == scenario.to_toml()
    longer = {"solver.duration": 3.5}
    assert scenario.replace(longer) == fs.load(data, longer)


def test_a_scenario_is_frozen_hashable_and_picklable() -> None:
    scenario = fs.load(PULLEY, {MU_S: 0.3})
    tables: list[tuple[Any, str]] = [(scenario, "title"), (scenario.solver, "rtol")]
    for model, name in (*tables, (scenario.drive.force, "time")):
        with pytest.raises(pydantic.ValidationError, match="frozen"):
            setattr(model, name, 1e-3)
    same, other = fs.load(PULLEY, {MU_S: 0.3}), fs.load(PULLEY)
    assert len({scenario, same, other}) == 2
    assert scenario != other
    assert scenario != fs.load(SCENARIOS / "epicyclic.toml")
    for copied in (pickle.loads(pickle.dumps(scenario)), copy.deepcopy(scenario)):
        assert copied == scenario
        assert hash(copied) == hash(scenario)
        assert copied.origin == scenario.origin


def test_an_effect_is_taken_out_by_none() -> None:
    mapping = fs.load(PULLEY, {"effects.viscous_damping": None})
    text = fs.load(PULLEY, ["effects.viscous_damping=none"])
    assert mapping.effect_names == text.effect_names == ("shaft_friction",)
    assert mapping.origin == text.origin
    assert mapping.origin.command.endswith("--set effects.viscous_damping=none")
    # A key that is not there may be taken out as well.
    assert fs.load(PULLEY, {"solver.max_step": None}) == fs.load(PULLEY)


def test_a_shipped_scenario_with_a_csv_file_stands_alone(tmp_path: Path) -> None:
    scenario = fs.loads(fs.new("hard/jump_from_csv"))
    shipped = fs.load(SCENARIOS / "hard" / "jump_from_csv.toml")
    assert (scenario.drive, scenario.effects) == (shipped.drive, shipped.effects)


def test_a_dict_may_name_files_in_a_folder(tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text("0,1832.6\n0.8,3113.75\n")
    data = pulley(drive={"force": {"csv": "force.csv"}})
    assert fs.load(data, folder=tmp_path).drive == fs.load(PULLEY).drive
    with pytest.raises(fs.ScenarioError, match=r"force\.csv"):
        fs.load(data)
