"""A scenario in a result holds its numbers itself: what others write there has no file read."""

import shutil
from pathlib import Path

import h5py
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"


def recorded(folder: Path, force: str) -> Path:
    """Return the file of a stopped run with another force in its scenario; it is whole else."""
    record = fs.solve(PULLEY, max_steps=40).record
    before, rest = record.attributes["scenario"].split("[drive.force]\n")
    scenario = f"{before}[drive.force]\n{force}\n[{rest.partition(chr(10) + '[')[2]}"
    changed = record._replace(attributes=record.attributes | {"scenario": scenario})
    return fs.Result(changed).save(folder / "a.h5")


def test_no_file_is_read_for_a_recorded_scenario(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "secret.txt").write_text("db.internal 5432 prod admin hunter2-secret\n")
    stopped = recorded(tmp_path, 'csv = "secret.txt"')
    assert fs.run_command_line(["resume", str(stopped), "-q"]) == 2
    said = capsys.readouterr().err
    assert (
        "a.partial.h5: its scenario is not valid: drive.force.csv: a scenario in a result holds"
        in said
    )
    assert "hunter2" not in said
    with pytest.raises(fs.InputError, match="and refers to no file; was the result changed"):
        _ = fs.open(stopped).scenario
    assert fs.run_command_line(["show", str(stopped), "--scenario"]) == 0
    assert "hunter2" not in capsys.readouterr().out


def test_the_recorded_command_solves_the_scenario_from_where_it_was_solved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    shutil.copy(PULLEY, "in/a.toml")
    result = fs.solve("in/a.toml", output="a.h5", max_steps=40)
    assert result.record.attributes["command"] == "frictionsim solve in/a.toml"
    assert fs.resume("a.h5").record.attributes["command"] == "frictionsim solve in/a.toml"
    shipped = fs.solve("hard/decay", output="b.h5")
    assert shipped.record.attributes["command"] == "frictionsim solve hard/decay"


def test_the_source_of_a_recorded_scenario_is_a_name(tmp_path: Path) -> None:
    fs.solve(PULLEY, output=tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs["source"] = "/home/of/another/s.toml"
    assert fs.open(tmp_path / "a.h5").scenario.origin.source == "s.toml"
