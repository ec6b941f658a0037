"""Reports from Python: what is refused, with which words."""

from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import ArgumentError, InputError, OutputError
from tests.support.scenarios import SCENARIOS

FAST = {"solver.rtol": 1e-6, "solver.duration": 0.1}


@pytest.fixture(scope="module")
def pulley(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("results") / "pulley.h5"
    fs.solve(SCENARIOS / "pulley.toml", FAST, output=path)
    return path


def refused(tmp_path: Path, *sources: Path) -> str:
    """Return what is said of sources of which no report is made, and check that none is."""
    target = tmp_path / "report.html"
    with pytest.raises(InputError) as error:
        fs.report(list(sources), target)
    assert not target.exists()
    return str(error.value)


def test_a_report_replaces_a_report_unless_that_is_forbidden(pulley: Path, tmp_path: Path) -> None:
    target = fs.report([pulley, fs.open(pulley)], tmp_path / "report.html")
    assert "<h1>Comparison: Pulley on a dry shaft</h1>" in target.read_text(encoding="utf-8")
    with pytest.raises(OutputError, match="--no-clobber forbids to replace it"):
        fs.report(pulley, target, no_clobber=True)
    fs.report(fs.open(pulley), target)
    assert "<h1>Pulley on a dry shaft</h1>" in target.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["c.txt", "report", "a.html.gz"])
def test_a_report_is_written_into_html_only(name: str, pulley: Path, tmp_path: Path) -> None:
    words = rf"{name}: expected the name of a report, which ends in \.html or \.htm"
    with pytest.raises(InputError, match=words):
        fs.report(tmp_path / "missing.h5", tmp_path / name)  # said before anything is read
    assert list(tmp_path.iterdir()) == []
    assert fs.report(pulley, tmp_path / "a.HTM").exists()


def test_the_same_file_twice_is_refused(pulley: Path, tmp_path: Path) -> None:
    twice = pulley.parent / ".." / pulley.parent.name / pulley.name
    assert refused(tmp_path, pulley, twice) == (
        f"{twice}: this result is given twice; compare it with another one"
    )


def test_results_of_unlike_kinds_are_refused(pulley: Path, tmp_path: Path) -> None:
    gear = tmp_path / "gear.h5"
    fs.solve(SCENARIOS / "epicyclic.toml", FAST, output=gear)
    assert refused(tmp_path, pulley, gear) == (
        f"cannot compare results of unlike kinds: {pulley} is of kind pulley, {gear} of kind"
        " epicyclic; give results of one kind"
    )


def test_a_sweep_is_not_compared_with_a_result(pulley: Path, tmp_path: Path) -> None:
    sweep = tmp_path / "s.h5"
    fs.sweep(SCENARIOS / "pulley.toml", {"mechanism.load": [2000.0]}, FAST, output=sweep, workers=1)
    assert refused(tmp_path, pulley, sweep) == (
        f"{sweep}: a sweep is not compared with results of runs; report it by itself, or vary"
        " more keys in one sweep"
    )


def test_too_many_results_are_refused(pulley: Path, tmp_path: Path) -> None:
    paths = [pulley.with_name(f"{number}.h5") for number in range(9)]
    assert refused(tmp_path, *paths) == (
        "a report compares at most 8 results, got 9; give fewer, or run them as a sweep"
    )


def test_no_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="expected a result or several, got none"):
        fs.report([], tmp_path / "report.html")


def test_what_is_no_result_is_refused_with_a_sentence(pulley: Path, tmp_path: Path) -> None:
    content = pulley.read_bytes()
    damaged, cut, empty, foreign = (
        tmp_path / name for name in ("damaged.h5", "cut.h5", "empty.h5", "foreign.h5")
    )
    damaged.write_bytes(content.replace(b"shaft", b"shift", 1))
    cut.write_bytes(content[: len(content) // 2])
    empty.write_bytes(b"")
    foreign.write_text("kind = 'pulley'")
    why = "cannot read this result"
    for path, reason in {
        damaged: "it is damaged (its checksum does not match)",
        cut: "it is not a readable HDF5 file",
        empty: "it is not a readable HDF5 file",
        foreign: "it is not a readable HDF5 file",
        tmp_path: "this is a folder; give the name of a result file",
        tmp_path / "none.h5": "there is no such file",
    }.items():
        assert refused(tmp_path, path).startswith(f"{path}: {why}: {reason}")


def test_a_report_does_not_replace_another_file(pulley: Path, tmp_path: Path) -> None:
    target = tmp_path / "page.html"
    target.write_text("<p>a page of somebody</p>")
    with pytest.raises(OutputError, match="the existing file is not a report"):
        fs.report(pulley, target)
    assert target.read_text() == "<p>a page of somebody</p>"
