"""A scenario in a result holds its numbers itself: what others write there has no file read."""

import shutil
from pathlib import Path

import h5py
import pytest

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.io.checksum import append_trailer
from frictionsim.io.result_format import state_digest
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
POINTS = "time = [0.0, 0.8], value = [1832.6, 3113.75]"


def recorded(path: Path, force: str) -> None:
    """Write another force into the scenario of a stopped run, and renew digest and seal."""
    with h5py.File(path, "r+") as file:
        lines = str(file.attrs["scenario"]).split("[drive.force]\n")[0]
        rest = str(file.attrs["scenario"]).split("[drive.force]\n")[1].partition("\n[")
        file.attrs["scenario"] = f"{lines}[drive.force]\n{force}\n[{rest[2]}"
        group = file["checkpoint"]
        state = {name: item[...] for name, item in group.items() if not item.is_scale}
        group.attrs["digest"] = state_digest(dict(file.attrs), state)
    append_trailer(path)


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    path = fs.solve(PULLEY, output=tmp_path / "a.h5", max_steps=40).path
    assert path is not None
    return path


@pytest.mark.parametrize(
    "table", ['csv = "secret.txt"', 'csv = "secret.txt"\ntime = 1\nvalue = 2', 'csv = "/dev/zero"']
)
def test_no_file_is_read_for_a_recorded_scenario(
    table: str, stopped: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (stopped.parent / "secret.txt").write_text("db.internal 5432 prod admin hunter2-secret\n")
    recorded(stopped, table)
    assert run_command_line(["resume", str(stopped), "-q"]) == 2
    said = capsys.readouterr().err
    assert (
        "a.partial.h5: its scenario is not valid: drive.force.csv: a scenario in a result holds"
        in said
    )
    assert "hunter2" not in said
    with pytest.raises(fs.InputError, match="and refers to no file; was the result changed"):
        _ = fs.open(stopped).scenario
    assert run_command_line(["show", str(stopped), "--scenario"]) == 0
    assert "hunter2" not in capsys.readouterr().out


def test_a_csv_signal_is_recorded_as_its_numbers(tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text("0, 1832.6\n0.8, 3113.75\n")
    scenario = tmp_path / "s.toml"
    text = PULLEY.read_text().replace(POINTS, 'csv = "force.csv"')
    assert text != PULLEY.read_text()
    scenario.write_text(text)
    result = fs.solve(scenario, output=tmp_path / "a.h5", max_steps=40)
    assert "csv" not in fs.open(result.path).record.attributes["scenario"]  # type: ignore[arg-type]
    assert fs.resume(tmp_path / "a.h5").status == "done"


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


def test_the_source_of_a_recorded_scenario_is_a_name(stopped: Path) -> None:
    with h5py.File(stopped, "r+") as file:
        file.attrs["source"] = "/home/of/another/s.toml"
    append_trailer(stopped)
    assert fs.open(stopped).scenario.origin.source == "s.toml"
