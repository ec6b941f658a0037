"""The net says nothing of equal commits, and of a change how large it is."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.net import artists, channels, commands, faults
from tests.net.differences import compare, differences
from tests.net.writing import write
from tests.support.scenarios import ROOT

PARTS = ("channels", "faults")
SHORT = {"solver.duration": 1e-3, "output.interval": 1e-3}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of a small part of the net."""
    folder = tmp_path_factory.mktemp("net")
    write(folder, [("channels", "hard/lift_moment_of_slack"), ("faults", "0")], PARTS)
    return folder


@pytest.mark.slow
def test_a_commit_does_not_differ_from_itself(written: Path) -> None:
    lines, same = compare(written, written, PARTS, whole=False)
    assert same
    assert lines == [
        "channels: 21 same, 0 different, 0 missing, 0 new",
        "faults: 10 same, 0 different, 0 missing, 0 new",
    ]


@pytest.mark.slow
def test_a_difference_is_named_with_its_size(written: Path, tmp_path: Path) -> None:
    changed = shutil.copytree(written, tmp_path / "changed")
    edit(changed / "channels.json", move_the_end)
    edit(changed / "faults.json", word_differently)
    lines, same = compare(written, changed, PARTS, whole=False)
    assert not same
    assert lines == [
        "channels: 20 same, 1 different, 0 missing, 0 new",
        "faults: 9 same, 1 different, 0 missing, 0 new",
        "",
        "channels:",
        "4.5e-02 relative, hard/lift_moment_of_slack: channels.angle by 1 of 22.1",
        "",
        "faults:",
        "1 x 001: stderr: 'frictionsim: SCENARIO is missing; see frictionsim solve --help' ->"
        " 'frictionsim: SCENARIO is absent; see frictionsim solve --help'",
    ]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ({"a": 0, "b": 1}, {"a": 0.0, "b": 2}, ["0 -> 0.0", "1 -> 2"]),
        ({"a": 1, "b": True}, {"a": 1.0, "b": 1}, ["1 -> 1.0", "true -> 1"]),
        (float("nan"), float("nan"), []),
        ([1.0, float("inf")], [1.0, float("-inf")], ["Infinity -> -Infinity"]),
    ],
)
def test_types_and_numbers_that_are_non_finite_are_distinguished(
    old: Any, new: Any, said: list[str]
) -> None:
    assert [difference.words for difference in differences(old, new)] == said


def test_of_a_long_text_the_first_changed_lines_are_shown_and_all_counted() -> None:
    old = [f"line {i}" for i in range(300)]
    new = [line + "!" if i in (200, 210, 220, 230, 240) else line for i, line in enumerate(old)]
    *first, rest = list(differences(old, new))
    assert [difference.place for difference in first] == [" line 201", " line 211", " line 221"]
    assert rest.words == "5 lines differ of 300 -> 300"


def test_views_of_the_net_are_those_of_the_program() -> None:
    for kind, names in artists.VIEWS.items():
        with pytest.raises(fs.InputError, match=f"known: {', '.join(names)}$"):
            fs.plot(fs.solve(kind, SHORT), view="none")


def edit(path: Path, change: Any) -> None:
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


def move_the_end(data: dict[str, Any]) -> None:
    angle = data["hard/lift_moment_of_slack"]["channels"]["angle"]
    angle["samples"][-1] -= 1.0
    angle["hash"] = "another"


def word_differently(data: dict[str, Any]) -> None:
    data["001"]["stderr"] = [line.replace("missing", "absent") for line in data["001"]["stderr"]]


def test_a_sequence_of_commands_tells_what_its_files_hold_and_its_views_draw(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        commands,
        "sequences",
        lambda: {"one": ["solve pulley -o a.h5", "show a.h5 --json > a.json"]},
    )
    told = {(part, name) for part, name, _ in commands.of_sequence("one", tmp_path)}
    views = {("figures", f"one: a.h5 {view}") for view in ("?", "response", "traction", "motion")}
    assert views | {("files", "one: a.h5"), ("commands", "one: a.json")} <= told


def test_names_are_those_of_the_shipped_scenarios() -> None:
    shipped = {
        p.relative_to(ROOT / "scenarios").with_suffix("")
        for p in (ROOT / "scenarios").rglob("*.toml")
    }
    assert set(map(Path, channels.names())) == shipped
    assert set(faults.SOURCES) <= set(map(str, shipped))
    assert "pulley" in commands.names()
