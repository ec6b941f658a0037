"""`solve` with several scenarios, and scenarios from the standard input."""

import io
import signal
import sys
from pathlib import Path

import h5py
import pytest
import tomli_w

import frictionsim as fs
from tests.cli.conftest import Run, long_run, strict_json
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS, pulley

PULLEY, RETURN = str(SCENARIOS / "pulley.toml"), str(SCENARIOS / "pulley_return.toml")


def give(text: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the standard input hold a text."""
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))


def test_each_has_a_file_and_a_summary(told: Run) -> None:
    out, err = told("solve", PULLEY, RETURN)
    assert err == ""
    files = ["results/pulley.h5", "results/pulley_return.h5"]
    assert [line for line in out.splitlines() if line.startswith("result: ")] == [
        f"result: {name}" for name in files
    ]
    assert fs.open(Path(files[1])).record.attributes["status"] == "done"
    documents = strict_json(told("solve", RETURN, PULLEY, "--json")[0])
    assert [item["scenario"] for item in documents] == [RETURN, PULLEY]
    assert [item["output"] for item in documents] == files[::-1]
    assert isinstance(strict_json(told("solve", PULLEY, "--json")[0]), dict)


def test_shipped_ones_are_solved_by_name(told: Run) -> None:
    documents = strict_json(told("solve", "pulley", "hard/jump", "--json")[0])
    assert [item["scenario"] for item in documents] == ["pulley", "hard/jump"]
    assert [item["output"] for item in documents] == ["results/pulley.h5", "results/jump.h5"]
    by_name = Path("results/pulley.h5").read_bytes()
    told("solve", PULLEY, "-q")
    assert Path("results/pulley.h5").read_bytes() == by_name
    assert told("check", "pulley")[0].startswith("pulley: ok; effects shaft_friction")


def test_output_is_a_folder_or_the_only_file(told: Run, here: Path) -> None:
    Path("down").mkdir()
    assert told("solve", PULLEY, RETURN, "-q", "-o", "down") == ("", "")
    written = ["down", "down/b.h5", "down/pulley.h5", "down/pulley_return.h5"]
    assert told("solve", PULLEY, "-o", "down/b.h5", "--quiet") == ("", "")
    Path("down/pulley.h5").unlink()
    for folder in ("down", "down/"):  # the same for one scenario, as a loop of a shell gives it
        assert told("solve", PULLEY, "-o", folder, "--quiet") == ("", "")
    assert sorted(str(path.relative_to(here)) for path in here.rglob("*")) == written


def test_a_folder_of_results_is_made_beside_what_is_there(told: Run) -> None:
    for folder, scenarios in (
        ("one/", [PULLEY]),
        ("two", [PULLEY, RETURN]),
        ("two/three/", [RETURN]),
    ):
        assert told("solve", *scenarios, "-q", "-o", folder) == ("", "")
        names = [Path(folder, Path(scenario).stem).with_suffix(".h5") for scenario in scenarios]
        assert [*map(h5py.is_hdf5, names)] == [True] * len(names)
    for folder, why in (
        ("a/b/", "No such file or directory"),
        ("one/pulley.h5/", "this is a file"),
    ):
        _, err = told("solve", PULLEY, "-q", "-o", folder, code=4)
        assert f"cannot create the folder '{Path(folder)}' ({why})" in err
    assert not Path("a").exists()


def test_warnings_of_several_name_the_scenario(told: Run) -> None:
    for scenarios, prefix in ([PULLEY], "warning: "), ([PULLEY, RETURN], f"warning: {PULLEY}: "):
        _, err = told("solve", *scenarios, "--set", "solver.duration=0.2", "-q")
        assert err.splitlines()[0].startswith(f"frictionsim: {prefix}nothing moves")


def test_the_exit_code_is_the_highest(told: Run) -> None:
    Path("short.toml").write_text(tomli_w.dumps(pulley(solver={"max_steps": 10})))
    out, err = told("solve", PULLEY, "short.toml", RETURN, "--json", code=5)
    assert [item["status"] for item in strict_json(out)] == ["done", "failed", "done"]
    assert "run failed: limit of 10 steps reached" in err


def test_one_that_cannot_be_solved_does_not_stop_the_others(told: Run) -> None:
    """A belt without a position of rest, which only the start of a run tells."""
    belt = pair(solver__backend="moreau", solver__rtol=None, effects__gravity={"g": 1e9})
    Path("first.toml").write_text(tomli_w.dumps(belt))
    assert told("check", "first.toml")[0].startswith("first.toml: ok; ")
    out, err = told("solve", "first.toml", RETURN, "--json", code=2)
    assert [item["scenario"] for item in strict_json(out)] == [RETURN]
    assert any(line.startswith("frictionsim: first.toml: ") for line in err.splitlines())
    assert "rest" in err
    assert told("solve", "first.toml", code=2)[0] == ""


def test_the_standard_input_is_a_scenario(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    give(Path(PULLEY).read_bytes(), monkeypatch)
    document = strict_json(
        told("solve", "-", "--json", "--set", "mechanism.load=2000", "--backend", "rkf45")[0]
    )
    assert (document["scenario"], document["output"]) == ("-", "results/stdin.h5")
    with h5py.File("results/stdin.h5") as file:
        assert file.attrs["source"] == "<stdin>"
        assert file.attrs["command"] == (
            "frictionsim solve - --set mechanism.load=2000 --set solver.backend=rkf45"
        )


def test_the_standard_input_may_be_one_of_several(
    told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    give(Path(PULLEY).read_bytes(), monkeypatch)
    out, _ = told("check", RETURN, "-")
    assert out.splitlines()[1].startswith("-: ok; effects shaft_friction")
    give(Path(PULLEY).read_bytes(), monkeypatch)
    assert strict_json(told("static", "-", "--json")[0])["scenario"] == "-"
    give(Path(PULLEY).read_bytes(), monkeypatch)
    both = ("--vary", "mechanism.load=[1]", "--set", "mechanism.load=2.0")
    assert "both set for all runs and varied" in told("sweep", "-", *both, code=2)[1]


BAD = {
    b"": "<stdin>:1: kind: the scenario is empty; it starts with kind, one of 'pulley',"
    " 'marble_machine', 'epicyclic', 'shaft', 'belt_drive'",
    b"#" * (16 * 2**20 + 1): "-: the file is larger than 1 MiB; use CSV files for signals",
    b'kind = "\xff"': "-: expected a scenario in TOML on the standard input, got invalid UTF-8 at"
    " byte 8",
    b"kind = \n": "<stdin>:1: not valid TOML: Invalid value, in 'kind ='",
    b'kind = "puley"': "<stdin>:1: kind: unknown kind 'puley' (did you mean 'pulley'?)",
}


@pytest.mark.parametrize("text", BAD, ids=["empty", "long", "not UTF-8", "not TOML", "kind"])
def test_a_bad_standard_input_is_one_sentence(
    text: bytes, told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    give(text, monkeypatch)
    assert told("solve", "-", code=2) == ("", f"frictionsim: {BAD[text]}\n")


def test_a_closed_standard_input_is_reported(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    _, err = told("solve", "-", code=2)
    assert err == "frictionsim: -: the standard input is closed; expected a scenario in TOML\n"


def test_a_mark_of_the_byte_order_is_no_error(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    give(b"\xef\xbb\xbf" + Path(PULLEY).read_bytes(), monkeypatch)
    assert told("check", "-")[0].startswith("-: ok")


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals of POSIX")
def test_ctrl_c_between_and_in_runs_ends_the_command(here: Path) -> None:
    """As a process: the second of two long runs does not start."""
    with long_run(here, "a.toml", "b.toml") as process:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "frictionsim: not solved: 1 of the scenarios, after this one" in err
    assert "run interrupted: by SIGINT" in err
    assert "b.toml" not in out + err
    assert fs.run_command_line(["show", "results/a.h5"]) == 0


def test_all_faults_of_all_scenarios_are_told_and_none_is_solved(told: Run) -> None:
    Path("a.toml").write_text(tomli_w.dumps(pulley(solver={"max_steps": 0, "rtol": -1.0})))
    Path("b.toml").write_text("kind = 3\n")
    out, err = told("solve", PULLEY, "a.toml", "none.toml", "b.toml", code=2)
    assert out == ""
    places = [line.removeprefix("frictionsim: ").split(": ")[0] for line in err.splitlines()]
    assert [place.split(":")[0] for place in places] == ["a.toml", "a.toml", "none.toml", "b.toml"]
    assert not Path("results").exists()
    _, err = told("solve", PULLEY, RETURN, "--set", "solver.rtoll=1", code=2)
    fault = "--set: solver.rtoll: unknown key 'rtoll' (did you mean 'rtol'?)"
    assert err == f"frictionsim: {PULLEY}: {fault}\n{RETURN}: {fault}\n"
