"""Completions of a shell: commands, options, kinds, shipped scenarios, views and backends."""

import shutil
from pathlib import Path

import pytest

import frictionsim as fs
from tests.cli.conftest import Run
from tests.support.plugins import searched, write_metadata
from tests.support.scenarios import python


def surroundings(*words: str) -> dict[str, str]:
    """Return bash's completions of the last word of a line."""
    return {
        "_FRICTIONSIM_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(("frictionsim", *words)),
        "COMP_CWORD": str(len(words)),
    }


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["s"], ["solve", "static", "show", "schema", "sweep"]),
        (["solve", "--max"], ["--max-wall", "--max-steps"]),
        (["show", "--"], ["--json", "--csv", "--scenario", "--study", "--help"]),
        (["schema", ""], list(fs.kinds())),
        (["new", "pul"], ["pulley", "pulley_horizontal", "pulley_return"]),
        (["new", "hard/belt_s"], ["hard/belt_slack", "hard/belt_squeal", "hard/belt_stiff_contact",
         "hard/belt_stiff_damping", "hard/belt_sudden_stop"]),
        (["plot", "a.h5", "--view", "t"], ["traction", "torque", "tension"]),
        (["plot", "a.h5", "--view", "a"], ["all"]),
        (["solve", "a.toml", "--backend", "rk"], ["rkf45", "rk45"]),
        (["sweep", "a.toml", "--method", ""], ["sobol", "lhs", "random"]),
    ],
)  # fmt: skip
def test_options_and_names_that_fit_are_offered(
    words: list[str], wanted: list[str], told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in surroundings(*words).items():
        monkeypatch.setenv(name, value)
    out, err = told()
    assert (out.split(), err) == (wanted, "")


def test_a_new_process_offers_words(tmp_path: Path) -> None:
    done = python("-m", "frictionsim", cwd=tmp_path, **surroundings("new", "pul"))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == ["pulley", "pulley_horizontal", "pulley_return"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_is_printed(
    shell: str, told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    out, err = told("--show-completion", shell)
    assert ("_FRICTIONSIM_COMPLETE" in out, err) == (True, "")


def test_plug_ins_that_conflict_are_left_out(
    told: Run, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for package in ("a", "b"):
        write_metadata(here, package, {"winch": "winch"})
    for name, value in surroundings("new", "p").items():
        monkeypatch.setenv(name, value)
    with searched(here):
        out, _ = told()
    assert out.split() == ["pulley", "pulley_horizontal", "pulley_return"]


def test_an_installation_without_scenarios_offers_the_kinds(tmp_path: Path) -> None:
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(fs.__file__).parent, tmp_path / "frictionsim", ignore=ignored)
    words = surroundings("new", "")
    done = python("-m", "frictionsim", cwd=tmp_path, PYTHONPATH=str(tmp_path), **words)
    assert (done.stdout.split(), done.stderr) == (list(fs.kinds()), "")
