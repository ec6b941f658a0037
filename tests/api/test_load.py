"""`load`: what it takes; what a Scenario can do."""

import copy
import pickle
import tomllib
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
from tests.support.examples import examples
from tests.support.scenarios import SCENARIOS, pulley

PULLEY = SCENARIOS / "pulley.toml"
# Without an interval between samples: it depends on the duration then.
PLAIN = pulley(output=None)
MU_S = "effects.shaft_friction.mu_s"


def test_a_path_a_text_and_a_dict_give_the_same_scenario() -> None:
    by_path, text = fs.load(PULLEY), PULLEY.read_text(encoding="utf-8")
    for loaded in (fs.load(str(PULLEY)), fs.load(tomllib.loads(text)), fs.loads(text)):
        assert loaded == by_path
    assert (by_path.origin.source, fs.load(pulley()).origin.source) == (str(PULLEY), "")
    assert (by_path.kind, by_path.title) == ("pulley", "Pulley on a dry shaft")


def test_a_dict_may_have_arrays_tuples_and_any_mapping_and_is_not_changed() -> None:
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
    before = copy.deepcopy(plain)
    assert fs.load(data) == fs.load(plain)
    assert fs.load(data, {MU_S: 0.3}) == fs.load(plain, {MU_S: 0.3})
    assert plain == before


@pytest.mark.parametrize(
    "title", ["a 'b' \"c\"", "smile \U0001f600", "\x85 and \u2028", "tab \\t", "é"]
)
def test_overrides_are_a_mapping_or_texts_and_are_kept(title: str, tmp_path: Path) -> None:
    scenario = fs.load(PULLEY, {MU_S: np.float64(0.3), "title": title, "solver.duration": 0.1})
    assert scenario.effects.shaft_friction.mu_s == 0.3
    assert scenario.title == title
    # The command solves the same scenario again.
    assert fs.load(PULLEY, scenario.origin.overrides) == scenario
    assert fs.load(PULLEY, (text for text in scenario.origin.overrides)) == scenario
    read = fs.open(fs.solve(scenario).save(tmp_path / "a.h5"))
    assert read.scenario.title == title
    assert read.scenario.origin.overrides == scenario.origin.overrides


def test_an_override_of_several_lines_is_kept_in_one() -> None:
    scenario = fs.load(PULLEY, ["drive.force.value=[1832.6, # at rest\n 3000.0]"])
    assert scenario.origin.overrides == ("drive.force.value=[1832.6, 3000.0]",)


def test_files_are_relative_to_the_scenario_the_folder_or_the_current_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "force.csv").write_text("0,1832.6\n0.8,3113.75\n")
    text, (begin, end) = PULLEY.read_text(encoding="utf-8"), ("force = ", "direction")
    changed = f'{text[: text.index(begin)]}force = {{csv = "force.csv"}}\n{text[text.index(end) :]}'
    (tmp_path / "a" / "s.toml").write_text(changed)
    expected = fs.load(PULLEY).drive
    scenario = fs.load(tmp_path / "a" / "s.toml")
    override = {"drive.force": {"csv": Path("force.csv")}}
    assert scenario.drive == scenario.replace(override).drive == expected
    data = pulley(drive={"force": {"csv": "force.csv"}})
    assert fs.load(data, folder=tmp_path / "a").drive == expected
    for source in (data, (PLAIN, override)):
        with pytest.raises(fs.ScenarioError, match=r"force\.csv"):
            fs.load(*source) if isinstance(source, tuple) else fs.load(source)
    monkeypatch.chdir(tmp_path / "a")
    assert fs.load(PLAIN, override).drive == expected


@pytest.mark.parametrize(
    "overrides",
    [
        {"solver.duration": 20.0},
        {"effects.shaft_friction.law": "regularised", "solver.backend": "rkf45"},
        {"output.interval": 0.25},
        {"effects": {}},
        ["solver.rtol=1e-5", "title=short"],
    ],
)
def test_replace_gives_what_load_gives(overrides: Any) -> None:
    for source in (PULLEY, PLAIN):
        loaded, replaced = fs.load(source, overrides), fs.load(source).replace(overrides)
        assert replaced == loaded
        assert replaced.origin == loaded.origin
        assert replaced.to_toml() == loaded.to_toml()
        # What was left out stays left out.
        assert replaced.solver.model_fields_set == loaded.solver.model_fields_set


def test_replace_adds_to_the_overrides_and_leaves_the_scenario() -> None:
    scenario = fs.load(PULLEY, {MU_S: 0.3})
    longer = scenario.replace({"solver.duration": 9.0}, title="longer")
    assert longer.origin.overrides == (f"{MU_S}=0.3", "solver.duration=9.0", "title=longer")
    assert (scenario.solver.duration, scenario.title) == (3.0, "Pulley on a dry shaft")
    assert scenario.replace() == scenario


@examples(8)
@given(data=st.one_of(pulleys(), marble_machines(), gears()))
def test_a_scenario_survives_its_tables_and_toml(data: dict[str, Any]) -> None:
    scenario = fs.load(data)
    # The interval depends on the duration; the tables have its value.
    whole = scenario.replace({"output.interval": scenario.interval})
    assert fs.load(scenario.to_dict()) == whole
    assert fs.loads(scenario.to_toml()) == whole
    assert hash(fs.load(scenario.to_dict())) == hash(whole)


def test_a_scenario_is_frozen_hashable_and_picklable() -> None:
    scenario = fs.load(PULLEY, {MU_S: 0.3})
    tables: list[tuple[Any, str]] = [(scenario, "title"), (scenario.solver, "rtol")]
    for model, name in (*tables, (scenario.drive.force, "time")):
        with pytest.raises(pydantic.ValidationError, match="frozen"):
            setattr(model, name, 1e-3)
    same, other = fs.load(PULLEY, {MU_S: 0.3}), fs.load(PULLEY)
    assert len({scenario, same, other}) == 2
    for copied in (pickle.loads(pickle.dumps(scenario)), copy.deepcopy(scenario)):
        assert (copied, hash(copied), copied.origin) == (scenario, hash(scenario), scenario.origin)


def test_an_effect_is_taken_out_by_none() -> None:
    mapping = fs.load(PULLEY, {"effects.viscous_damping": None})
    text = fs.load(PULLEY, ["effects.viscous_damping=none"])
    assert mapping.effect_names == text.effect_names == ("shaft_friction",)
    assert mapping.origin == text.origin
    assert mapping.origin.command.endswith("--set effects.viscous_damping=none")


def test_a_shipped_scenario_with_a_csv_file_stands_alone() -> None:
    shipped = fs.load(SCENARIOS / "hard" / "jump_from_csv.toml")
    assert fs.loads(fs.new("hard/jump_from_csv")).drive == shipped.drive
