"""Sweeps that are interrupted or killed, and go on: the same bytes, and no file that lies."""

import json
import os
import random
import re
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pytest

import frictionsim as fs
from tests.support.stopped_runs import stopped_at
from tests.support.sweep_files import LOAD, LOOSE, PULLEY

VARY = {LOAD: "lin(2000, 2400, 12)"}
SAMPLE = {LOAD: "normal(2200.0, 50.0)", "effects.shaft_friction.mu_s": "uniform(0.2, 0.4)"}
PART = "s.partial.runs"
posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="locks, limits and copies of POSIX")


def sweep(path: Path, **options: Any) -> fs.Sweep:
    """Run the sweep of these tests in this process."""
    given: dict[str, Any] = {"vary": VARY, "overrides": LOOSE, "workers": 1, **options}
    return fs.sweep(PULLEY, output=path, **given)


def after(runs: int, error: BaseException | None = None) -> Any:
    """Return a progress function that ends a sweep once some runs are done."""

    def progress(step: Any) -> None:
        if step.done >= runs and step.checked == step.total:
            raise error or KeyboardInterrupt

    return progress


def interrupted(folder: Path, runs: int = 5, **options: Any) -> Path:
    """Interrupt a sweep after some runs; return the unfinished file."""
    with pytest.raises(KeyboardInterrupt):
        sweep(folder / "s.h5", progress=after(runs), **options)
    return folder / PART


def runs_done(path: Path) -> int:
    return int((fs.open_sweep(path).table.status == 1).sum())


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of an uninterrupted sweep."""
    path = tmp_path_factory.mktemp("whole") / "s.h5"
    sweep(path)
    return path.read_bytes()


def test_an_interrupted_sweep_is_resumed_to_the_same_bytes(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    with pytest.raises(KeyboardInterrupt) as stopped:
        sweep(path, progress=after(5))
    part, done = tmp_path / PART, runs_done(tmp_path / PART)
    assert 5 <= done < 12
    assert str(stopped.value) == (
        f"sweep interrupted: {done} of 12 runs are saved in {part};"
        f" 'frictionsim resume {part}' continues the sweep"
    )
    assert os.listdir(tmp_path) == [PART]
    partial = fs.open_sweep(path)  # only the unfinished one stands
    assert (partial.status, partial.exit_code) == ("interrupted", 130)
    assert partial.reason == f"interrupted by SIGINT after {done} of 12 runs"
    assert partial.missing_runs.startswith(f"sweep interrupted: {12 - done} of 12 runs are left")
    known = np.isfinite(partial["final_angle"]).values.tolist()
    assert known == [True] * done + [False] * (12 - done)
    assert fs.plot(part).axes
    error = ZeroDivisionError("of the user")
    with pytest.raises(ZeroDivisionError) as caught:
        fs.resume_sweep(path, workers=1, progress=after(done + 1, error))
    assert caught.value is error
    assert fs.open_sweep(part).reason.startswith("stopped by an error (ZeroDivisionError) after ")
    assert runs_done(part) > done
    # With another number of workers, and the path spelt in another way.
    fs.resume_sweep(path, workers=2, output=os.path.relpath(path))
    assert path.read_bytes() == whole
    assert os.listdir(tmp_path) == ["s.h5"]


@posix
def test_a_sweep_killed_at_each_change_of_its_files_is_resumed(
    whole: bytes, tmp_path: Path
) -> None:
    for change in range(1, 99):
        folder = tmp_path / str(change)
        folder.mkdir()

        def work(path: Path = folder / "s.h5") -> int:
            sweep(path)
            return 0

        ended, part = stopped_at(change, work, folder), folder / PART
        if part.exists() and part.stat().st_size:
            fs.resume_sweep(part, workers=1)
        elif not (folder / "s.h5").exists():
            sweep(folder / "s.h5")
        assert (folder / "s.h5").read_bytes() == whole
        assert os.listdir(folder) == ["s.h5"]
        if ended == 0:
            break
    assert change > 5


def test_lines_that_are_torn_or_damaged_are_run_again(whole: bytes, tmp_path: Path) -> None:
    part = interrupted(tmp_path, 8)
    content, path, rng = part.read_bytes(), tmp_path / "s.h5", random.Random(3)
    first, *blocks = content.splitlines(keepends=True)
    full = runs_done(part)
    flipped = bytearray(content)
    flipped[len(first) + len(blocks[0]) // 2] ^= 1
    cuts = [rng.randrange(len(first), len(content)) for _ in range(2)]
    for changed in (flipped, first, *(content[:cut] for cut in cuts)):
        part.write_bytes(changed)
        opened = fs.open_sweep(part).table
        done = opened.status == 1
        assert done.sum() < full or changed == content[: len(changed)]
        assert np.array_equal(np.isfinite(opened.values.get("final_angle", np.nan)) & done, done)
        fs.resume_sweep(part, workers=1)
        assert path.read_bytes() == whole
        path.unlink()
    for damaged in (b"x" + content, content[:20] + b"y" + content[20:]):
        part.write_bytes(damaged)
        with pytest.raises(fs.InputError, match="cannot read this sweep: it is damaged"):
            fs.open_sweep(part)


@pytest.mark.parametrize("content", [b"", b'{"sweep_version": 1, "outp'])
def test_a_file_without_a_whole_first_line_says_that_it_holds_no_runs(
    content: bytes, tmp_path: Path
) -> None:
    part = tmp_path / PART
    part.write_bytes(content)
    for read in (fs.open_sweep, fs.resume_sweep, fs.plot):
        with pytest.raises(fs.InputError) as told:
            read(part)
        assert str(told.value) == (
            f"{part}: this sweep was stopped before its first runs and holds none; remove the file"
            " and start the sweep again"
        )
    assert sweep(tmp_path / "s.h5").status == "done"
    assert os.listdir(tmp_path) == ["s.h5"]


@posix
def test_two_processes_do_not_run_one_sweep(tmp_path: Path) -> None:
    import fcntl

    part = interrupted(tmp_path)
    before = part.read_bytes()
    with part.open("rb") as running:
        fcntl.flock(running, fcntl.LOCK_EX)
        for again, name in ((sweep, tmp_path / "s.h5"), (fs.resume_sweep, part)):
            with pytest.raises(fs.OutputError) as refused:
                again(name)
            assert str(refused.value) == (
                f"{part}: another process is running this sweep now; wait for its end, or stop it"
            )
    refusal = f"'frictionsim resume {part}' continues it; give another name, or remove it"
    change = f'{LOAD}: "lin(2000, 2400, 12)", now [2000.0]'
    differs = re.escape(f". It is of other values ({change})")
    for vary, end in (({}, ""), ({"vary": {LOAD: [2000.0]}}, differs)):
        with pytest.raises(fs.OutputError, match=f"this is an interrupted sweep: {refusal}{end}$"):
            sweep(tmp_path / "s.h5", **vary)
    assert part.read_bytes() == before


def test_what_cannot_be_resumed_is_refused(whole: bytes, tmp_path: Path) -> None:
    (tmp_path / "done.h5").write_bytes(whole)
    with pytest.raises(fs.InputError, match="this sweep is done; there is nothing to resume"):
        fs.resume_sweep(tmp_path / "done.h5")
    part = interrupted(tmp_path)
    copy = fs.open_sweep(part).save(tmp_path / "copy.h5")  # for other programs
    assert np.array_equal(fs.open_sweep(copy).table.status, fs.open_sweep(part).table.status)
    with pytest.raises(fs.InputError, match="this is a copy of a sweep that is not done"):
        fs.resume_sweep(copy)
    first, *blocks = part.read_bytes().splitlines(keepends=True)
    header = json.loads(first)
    del header["crc32"]
    header["attributes"]["frictionsim_version"] = "0.0.9"
    line = json.dumps(header)[:-1].encode()
    part.write_bytes(b"".join([line, b', "crc32": %d}\n' % crc32(line), *blocks]))
    with pytest.raises(fs.InputError, match=r"it was started with frictionsim 0\.0\.9, this is"):
        fs.resume_sweep(part)


def test_a_sweep_goes_on_under_another_name(whole: bytes, tmp_path: Path) -> None:
    part = interrupted(tmp_path)
    before, other = part.read_bytes(), tmp_path / "longer.hdf5"
    with pytest.raises(KeyboardInterrupt, match=r"saved in .*longer\.partial\.runs;"):
        fs.resume_sweep(part, workers=1, output=other, progress=after(7))
    assert runs_done(tmp_path / "longer.partial.runs") >= 7
    fs.resume_sweep(tmp_path / "longer.partial.runs", workers=1)
    assert other.read_bytes() == whole
    assert part.read_bytes() == before
    (tmp_path / "s.h5").write_bytes(whole)
    fs.resume_sweep(part, workers=1)
    assert sorted(os.listdir(tmp_path)) == ["longer.hdf5", "s.h5"]


def test_a_sample_is_not_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another version of SciPy may draw other numbers."""
    options: dict[str, Any] = {"sample": 6, "seed": 3, "method": "lhs", "vary": SAMPLE}
    sweep(tmp_path / "t.h5", **options)
    part = interrupted(tmp_path, 2, **options)
    monkeypatch.delattr("scipy.stats.qmc.LatinHypercube")
    fs.resume_sweep(part, workers=1)
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "t.h5").read_bytes()


def test_values_of_all_kinds_are_resumed(tmp_path: Path) -> None:
    vary = {
        "solver.max_steps": [10**400, 10_000_000],  # which no array holds
        "drive.force": [{"time": [0, 1], "value": [0.0, 3e3]}, 2500],
        "title": ['a "b"', "ä, =1"],
        "effects.viscous_damping": ["none", {"coefficient": 0.1}],
    }
    sweep(tmp_path / "t.h5", vary=vary)
    part = interrupted(tmp_path, 1, vary=vary)
    assert fs.open_sweep(part).sizes == fs.open_sweep(tmp_path / "t.h5").sizes
    fs.resume_sweep(part, workers=1)
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "t.h5").read_bytes()


@posix
def test_a_full_disk_keeps_what_is_done_and_says_how_to_continue(
    whole: bytes, tmp_path: Path
) -> None:
    from tests.support.file_sizes import limited_files

    first, *blocks = interrupted(tmp_path).read_bytes().splitlines(keepends=True)
    (tmp_path / PART).unlink()
    room = max(len(first) + int(1.5 * len(blocks[0])), 4096)  # what is written to see if it can be
    with limited_files(room), pytest.raises(fs.OutputError) as full:
        sweep(tmp_path / "s.h5")
    part = tmp_path / PART
    done = runs_done(part)
    assert done > 0
    assert str(full.value) == (
        f"{part}: cannot write the sweep: File too large. sweep interrupted: {done} of 12 runs are"
        f" saved in {part}; 'frictionsim resume {part}' continues the sweep"
    )
    fs.resume_sweep(part, workers=1)
    assert (tmp_path / "s.h5").read_bytes() == whole


def test_a_long_run_in_this_process_is_left(tmp_path: Path) -> None:
    begun, calls = time.monotonic(), []

    def stop(step: Any) -> None:
        calls.append(step)
        if len(calls) > 5:
            raise KeyboardInterrupt

    long = {"solver.max_step": 1e-7, "solver.max_steps": 10**9}  # minutes
    with pytest.raises(KeyboardInterrupt, match="0 of 12 runs are saved"):
        sweep(tmp_path / "s.h5", overrides=long, progress=stop)
    assert time.monotonic() - begun < 30.0


def test_series_are_kept_resumed_and_copied(tmp_path: Path) -> None:
    path, folder, vary = tmp_path / "s.h5", tmp_path / "s.series", {LOAD: [2000.0, 2100.0, 2200.0]}
    part = interrupted(tmp_path, 2, keep_series=True, vary=vary)
    assert sorted(os.listdir(folder)) == ["run-0000000.h5", "run-0000001.h5", "study.toml"]
    stamp = (folder / "run-0000000.h5").stat().st_mtime_ns
    (folder / "run-0000002.h5").write_text("mine\n")
    with pytest.raises(fs.OutputError, match=r"cannot write the result: .* 2 of 3 runs are saved"):
        fs.resume_sweep(part, workers=1)
    (folder / "run-0000002.h5").unlink()
    (tmp_path / "b").mkdir()
    other = tmp_path / "b" / "s.h5"
    fs.resume_sweep(part, output=other, workers=1)
    swept = fs.resume_sweep(path, workers=1)
    assert path.read_bytes() == other.read_bytes()
    assert sorted(os.listdir(folder)) == sorted(os.listdir(tmp_path / "b" / "s.series"))
    assert (folder / "run-0000000.h5").stat().st_mtime_ns == stamp
    result = fs.open(folder / "run-0000002.h5")
    assert len(result.dataset["time"]) > 100
    assert float(result.quantities["final_angle"]) == float(swept["final_angle"][2])
    plain = fs.sweep(PULLEY, vary, LOOSE, workers=1)
    assert np.array_equal(plain["final_angle"], swept["final_angle"])
    with pytest.raises(fs.OutputError, match="it is not a folder of the same study; move it"):
        sweep(path, keep_series=True)


def test_sweeps_of_two_threads_have_workers_of_their_own() -> None:
    def swept(runs: int) -> fs.Sweep:
        return fs.sweep(PULLEY, {LOAD: f"lin(2000, 2400, {runs})"}, LOOSE, workers=2)

    with ThreadPoolExecutor(2) as threads:
        few, many = threads.map(swept, (4, 300))
    assert (few.status, many.status, many.table.runs) == ("done", "done", 300)


@pytest.mark.parametrize("source", ["p.toml", "tables.toml"])
def test_signals_in_files_are_found_from_another_folder(
    source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are relative to the folder of the scenario, or of the study with its tables."""
    home = tmp_path / "home"
    home.mkdir()
    for number in range(3):
        (home / f"{number}.csv").write_text(f"t,F\n0.0,18{number}0\n0.8,3100\n")
    text = PULLEY.read_text(encoding="utf-8")
    (home / "p.toml").write_text(text, encoding="utf-8")
    vary = {"drive.force": [{"csv": f"{number}.csv"} for number in range(3)]}
    table = "".join(f"{{ csv = '{number}.csv' }}, " for number in range(3))
    tables = text[text.index("kind =") :].replace("\n[", "\n[study.scenario.")
    study = f"[study.scenario]\n{tables}[vary]\ndrive.force = [{table}]\n"
    (home / "tables.toml").write_text(study, encoding="utf-8")
    given = {"vary": vary} if source == "p.toml" else {}
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        fs.sweep(Path("home") / source, output="s.h5", workers=1, progress=after(1), **given)
    whole = fs.sweep(home / source, workers=1, **given)
    monkeypatch.chdir("/")
    assert fs.resume_sweep(tmp_path / PART, workers=2).equals(whole)
    assert np.isfinite(whole["final_angle"]).all()
