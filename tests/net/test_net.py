"""The net says nothing of equal commits, and of a change how large it is."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.net import channels, commands, faults
from tests.net.differences import compare
from tests.net.writing import write
from tests.support.scenarios import ROOT

PARTS = ("channels", "faults")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of a small part of the net."""
    folder = tmp_path_factory.mktemp("net")
    write(folder, [("channels", "hard/lift_moment_of_slack"), ("faults", "0")], PARTS)
    return folder


def test_a_commit_does_not_differ_from_itself(written: Path) -> None:
    lines, same = compare(written, written, PARTS, whole=False)
    assert same
    assert lines == [
        "channels: 21 same, 0 different, 0 missing, 0 new",
        "faults: 10 same, 0 different, 0 missing, 0 new",
    ]


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
        "1 x 'frictionsim: SCENARIO is missing; see frictionsim solve --help' ->"
        " 'frictionsim: SCENARIO is absent; see frictionsim solve --help' at 001: stderr",
    ]


def edit(path: Path, change: Any) -> None:
    found = json.loads(path.read_text())
    change(found)
    path.write_text(json.dumps(found))


def move_the_end(found: dict[str, Any]) -> None:
    angle = found["hard/lift_moment_of_slack"]["channels"]["angle"]
    angle["samples"][-1] -= 1.0
    angle["hash"] = "another"


def word_differently(found: dict[str, Any]) -> None:
    found["001"]["stderr"] = [line.replace("missing", "absent") for line in found["001"]["stderr"]]


def test_names_are_those_of_the_shipped_scenarios() -> None:
    shipped = {
        p.relative_to(ROOT / "scenarios").with_suffix("")
        for p in (ROOT / "scenarios").rglob("*.toml")
    }
    assert set(map(Path, channels.names())) == shipped
    assert set(faults.SOURCES) <= set(map(str, shipped))
    assert "pulley" in commands.names()
