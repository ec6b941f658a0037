"""Sweeps that are interrupted or killed, and go on: the same bytes, and no file that lies."""

import os
import signal
import time
import tomllib
from functools import partial
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from frictionsim.io.hdf5_reader import read_sweep
from frictionsim.io.unfinished import partial_name

import frictionsim as fs
from frictionsim.api import sweeping
from frictionsim.api.sweeping import SweepInterrupted
from frictionsim.cli.commands import run_command_line
from frictionsim.io import hdf5_reader
from frictionsim.io.checksum import LENGTH
from frictionsim.io.sweep_file import write_sweep
from frictionsim.io.sweep_table import MAX_QUANTITIES, ORDER
from frictionsim.parameter_study import dispatch, executors, sweep_files, values
from frictionsim.parameter_study import sweep as assembling
from frictionsim.parameter_study.block import DONE, RunOutcome, block_of
from frictionsim.parameter_study.journal import SweepJournal, journal_name
from frictionsim.parameter_study.sweep_files import SweepFiles
from frictionsim.results import Quantity
from frictionsim.simulation.monitor import SweepProgress
from tests.support.cases import one_in
from tests.support.sweep_files import LOAD, LOOSE, PULLEY

VARY = {LOAD: "lin(2000, 2400, 12)"}
SAMPLE = {LOAD: "normal(2200.0, 50.0)", "effects.shaft_friction.mu_s": "uniform(0.2, 0.4)"}


@pytest.fixture(autouse=True)
def ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Progress is reported as often as possible."""
    monkeypatch.setattr(dispatch, "SECONDS_BETWEEN_TICKS", 0.0)


def sweep(path: Path, **options: Any) -> Any:
    """Run the sweep of these tests in this process."""
    given: dict[str, Any] = {"vary": VARY, "overrides": LOOSE, "workers": 1, **options}
    return fs.sweep(PULLEY, output=path, **given)


def after(runs: int) -> Any:
    """Return a progress function that interrupts a sweep after some runs."""

    def progress(step: SweepProgress) -> None:
        if step.done >= runs and step.checked == step.total:
            raise SweepInterrupted(signal.SIGTERM)

    return progress


def interrupted(path: Path, runs: int = 5, **options: Any) -> str:
    """Interrupt a sweep; return the message."""
    with pytest.raises(SweepInterrupted) as stopped:
        sweep(path, progress=after(runs), **options)
    assert stopped.value.exit_code == 143
    return str(stopped.value)


def altered(path: Path, attributes: dict[str, str], **more: Any) -> bytes:
    """Give the file of a sweep other attributes; return its content."""
    table = read_sweep(path)
    write_sweep(table._replace(attributes=table.attributes | attributes, **more), path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of an uninterrupted sweep."""
    path = tmp_path_factory.mktemp("whole") / "s.h5"
    sweep(path)
    return path.read_bytes()


def test_an_interrupted_sweep_is_resumed_to_the_same_bytes(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    assert interrupted(path) == (
        f"sweep interrupted: 5 of 12 runs are saved in {partial_name(path)};"
        f" 'frictionsim resume {partial_name(path)}' continues the sweep"
    )
    assert os.listdir(tmp_path) == ["s.partial.h5"]
    partial = fs.open_sweep(path)  # only the unfinished one stands
    assert partial.attrs["status"] == "interrupted"
    assert partial.attrs["reason"] == "interrupted by SIGTERM after 5 of 12 runs"
    assert partial["status"].values.tolist() == [1] * 5 + [0] * 7
    assert np.isnan(partial["final_angle"][5:]).all()
    assert not np.isnan(partial["final_angle"][:5]).any()
    # Once more, with another number of workers.
    with pytest.raises(SweepInterrupted, match="7 of 12 runs are saved"):
        fs.resume_sweep(path, workers=1, progress=after(7))
    fs.resume_sweep(path, workers=2)
    assert path.read_bytes() == whole
    assert os.listdir(tmp_path) == ["s.h5"]


def test_quantities_are_limited_so_that_the_file_can_be_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quantities = len(fs.sweep(PULLEY, VARY, LOOSE, workers=1).table.values)
    monkeypatch.setattr(assembling, "MAX_VALUES", 12 * quantities)
    interrupted(tmp_path / "s.h5")
    before = partial_name(tmp_path / "s.h5").read_bytes()
    sweep(tmp_path / "t.h5")
    monkeypatch.setattr(assembling, "MAX_VALUES", 12 * quantities - 1)
    said = f"a file of 12 runs can have {quantities - 1} quantities, and this sweep has more"
    monkeypatch.setattr(dispatch, "MAX_RUNS_OF_A_BLOCK", 1)
    names = sorted(os.listdir(tmp_path))
    for run in (partial(sweep, tmp_path / "u.h5"), partial(fs.resume_sweep, tmp_path / "s.h5")):
        with pytest.raises(fs.InputError, match=said):
            run(workers=1)
    assert sorted(os.listdir(tmp_path)) == names  # refused at the first block: nothing is left
    assert partial_name(tmp_path / "s.h5").read_bytes() == before  # refused before any
    fs.sweep(PULLEY, VARY, LOOSE, workers=1)  # without a file
    monkeypatch.undo()
    many = {f"q{number}": Quantity(1.0, "m") for number in range(MAX_QUANTITIES + 1)}
    with pytest.raises(fs.InputError, match="a file of 1 runs can have 1900 quantities"):
        assembling.Assembly(1, filed=True).add(block_of(0, [(0, RunOutcome(DONE, many))]))


def test_an_unfinished_file_has_the_order_of_as_many_quantities_as_a_file_can_have(
    tmp_path: Path,
) -> None:
    interrupted(tmp_path / "s.h5")
    path = partial_name(tmp_path / "s.h5")
    order = dumps({f"a_quantity_with_a_long_name_{n}": (0, n) for n in range(MAX_QUANTITIES)})
    altered(path, {ORDER: order})
    assert read_sweep(path).attributes[ORDER] == order


def test_a_sample_is_not_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, again = tmp_path / "s.h5", tmp_path / "t.h5"
    options: dict[str, Any] = {"sample": 6, "seed": 3, "method": "lhs", "vary": SAMPLE}
    sweep(again, **options)
    interrupted(path, 2, **options)
    monkeypatch.delattr("frictionsim.parameter_study.design._points")
    fs.resume_sweep(path, workers=1)
    assert path.read_bytes() == again.read_bytes()


def test_a_complete_sweep_and_an_unfinished_one_stay_until_the_next_is_complete(
    whole: bytes, tmp_path: Path
) -> None:
    path, other = tmp_path / "s.h5", tmp_path / "a" / "longer.h5"
    other.parent.mkdir()
    path.write_bytes(whole)
    part = partial_name(path)
    assert f"saved in {part};" in interrupted(path)
    before = part.read_bytes()
    with pytest.raises(SweepInterrupted, match=r"saved in .*longer\.partial\.h5;"):
        fs.resume_sweep(part, workers=1, output=other, progress=after(7))
    fs.resume_sweep(partial_name(other), workers=1)
    assert other.read_bytes() == path.read_bytes() == whole
    assert os.listdir(other.parent) == ["longer.h5"]
    assert part.read_bytes() == before
    fs.resume_sweep(part, workers=1)
    assert path.read_bytes() == whole
    assert sorted(os.listdir(tmp_path)) == ["a", "s.h5"]


def test_a_resumed_sweep_is_not_written_through_a_link_that_nobody_named(
    whole: bytes, tmp_path: Path
) -> None:
    path, precious = tmp_path / "s.h5", tmp_path / "precious.h5"
    sweep(precious, vary={LOAD: [2000.0]})
    before = precious.read_bytes()
    interrupted(path)
    path.symlink_to(precious)
    part = partial_name(path)
    with pytest.raises(fs.OutputError) as refused:
        fs.resume_sweep(part, workers=1)
    assert str(refused.value) == (
        f"{path}: cannot write the sweep: this is a link; remove it, or give another name"
    )
    assert precious.read_bytes() == before
    # One that the user names is followed.
    fs.resume_sweep(part, workers=1, output=path)
    assert precious.read_bytes() == whole
    # The unfinished name of a sweep of an earlier version is not one that the user named.
    path.unlink()
    interrupted(path)
    part.rename(path)
    part.symlink_to(tmp_path / "new.h5")
    with pytest.raises(
        fs.OutputError, match=r"s\.partial\.h5: cannot write the sweep: this is a l"
    ):
        fs.resume_sweep(path, workers=1)


def test_a_resumed_sweep_is_read_once_and_once_more_when_it_is_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(tmp_path / "s.h5")
    read: list[Path] = []
    read_any = hdf5_reader.read_any

    def noted(path: Path) -> Any:
        read.append(path)
        return read_any(path)

    monkeypatch.setattr(hdf5_reader, "read_any", noted)
    part = partial_name(tmp_path / "s.h5")
    assert run_command_line(["resume", str(part), "-q", "-j", "1"]) == 0
    assert read == [part, part]


def test_an_unfinished_sweep_of_an_earlier_version_is_resumed(
    whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.h5"
    journal = killed(path, monkeypatch)
    for suffix in ("", "-wal"):  # as the files were called
        Path(f"{journal}{suffix}").rename(f"{journal_name(path)}{suffix}")
    partial_name(path).rename(path)
    assert runs_kept(path) == 5
    assert path.read_bytes() == whole
    assert os.listdir(tmp_path) == ["s.h5"]


def runs_kept(path: Path) -> int:
    """Resume a sweep; return how many runs it did not repeat."""
    ran: list[int] = []
    fs.resume_sweep(path, workers=1, progress=lambda step: ran.append(step.done))
    return min(ran)


def killed(path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Leave the files of a sweep that was killed after some runs; return its journal."""

    journal = journal_name(partial_name(path))
    kept: dict[Path, bytes] = {}

    def keep(*_: Any) -> None:
        kept.update({file: file.read_bytes() for file in (journal, Path(f"{journal}-wal"))})

    with monkeypatch.context() as patch:
        patch.setattr(SweepFiles, "write_unfinished", keep)
        interrupted(path)
    for file, content in kept.items():
        file.write_bytes(content)
    return journal


def test_the_runs_in_the_journal_of_a_killed_sweep_are_kept_up_to_a_torn_or_damaged_end(
    whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.h5"
    journal = killed(path, monkeypatch)
    step = fs.open_sweep(path)
    assert not step["status"].any()
    assert step.attrs["reason"] == (
        "killed, or still running; 'frictionsim resume' continues it, including the runs journalled"
        " in s.partial.h5.runs"
    )
    assert step.missing_runs.startswith("sweep interrupted: at most 12 of 12 runs are left: killed")
    log, incomplete = Path(f"{journal}-wal"), partial_name(path).read_bytes()
    content, records = journal.read_bytes(), log.read_bytes()
    with pytest.raises(fs.OutputError, match="this is an interrupted sweep: 'frictionsim resume"):
        sweep(path, vary={LOAD: [2000.0]})
    assert partial_name(path).read_bytes() == incomplete
    assert journal.exists()
    flipped = bytearray(records)
    flipped[-100] ^= 1
    for bad, last, kept in (
        (content, records, 5),
        (content, records[:-1], 4),
        (content, bytes(flipped), 4),
        (content, records + b"\0" * 100, 5),
        (content, b"", 0),
        (content[:-1], b"", 0),
        (b"", b"", 0),
    ):
        partial_name(path).write_bytes(incomplete)
        journal.write_bytes(bad)
        log.write_bytes(last)
        assert runs_kept(path) == kept
        assert path.read_bytes() == whole
        assert os.listdir(tmp_path) == ["s.h5"]
        path.unlink()


def test_two_sweeps_do_not_write_one_file(tmp_path: Path) -> None:
    path = partial_name(tmp_path / "s.h5")
    interrupted(tmp_path / "s.h5")
    before = path.read_bytes()
    running = SweepJournal(path)
    for again, name in ((sweep, tmp_path / "s.h5"), (fs.resume_sweep, path)):
        with pytest.raises(fs.OutputError) as refused:
            again(name)
        assert str(refused.value) == (
            f"{path}: another process is running this sweep now; wait for its end, or stop it"
        )
    assert path.read_bytes() == before
    running.close(remove=True)


def test_what_cannot_be_resumed_is_refused(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    path.write_bytes(whole)
    left = SweepJournal(partial_name(path))  # of a process that was killed at its end
    left.start(bytes(32))
    left.close(remove=False)
    with pytest.raises(fs.InputError, match="this sweep is done; there is nothing to resume"):
        fs.resume_sweep(path)
    assert not journal_name(partial_name(path)).exists()
    interrupted(tmp_path / "t.h5")
    edited = tmp_path / "t.partial.h5"
    attributes = read_sweep(edited).attributes
    order = attributes[ORDER]
    assert "[0, 0]" in order
    for name, value, message in (
        ("frictionsim_version", "0.0.9", "it was started with frictionsim 0.0.9, this is"),
        ("study", "vary = 1", "study"),
        ("study", "x=" + "[" * 30_000, "its study is not that of its values"),
        ("design", "sample", "its study is not that of its values"),
        (ORDER, "[" * 30_000, "it is damaged"),
        (ORDER, "{}", "it is damaged"),
        (ORDER, order.replace("[0, 0]", "[1e999, 0]"), "it is damaged"),
    ):
        before = altered(edited, attributes | {name: value})
        with pytest.raises(fs.InputError, match=message):
            fs.resume_sweep(edited, workers=1)
        assert edited.read_bytes() == before
        assert not journal_name(edited).exists()


def test_a_sweep_made_by_others_has_no_other_file_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    interrupted(tmp_path / "s.h5")
    path = tmp_path / "s.partial.h5"
    for name in ("scenario.toml", "secret.csv"):
        (tmp_path / name).write_text("password")
    study = tomllib.loads(read_sweep(path).attributes["study"])
    scenario = study["study"]["scenario"]
    from_a_file = scenario | {"drive": {"force": {"csv": "secret.csv"}}}
    for given, said in (
        ("scenario.toml", "expected the tables of a scenario"),
        (from_a_file, "csv"),
    ):
        study["study"]["scenario"] = given
        altered(path, {"study": tomli_w.dumps(study)})
        with pytest.raises(fs.InputError) as refused:
            fs.resume_sweep(path, workers=1)
        assert said in str(refused.value)
        assert "password" not in str(refused.value)


ONE_KEY = {LOAD: "uniform(2000.0, 2100.0)"}


@pytest.mark.parametrize(
    ("options", "changes"),
    one_in(
        2,
        [
            *(
                ({"zip": together}, {"vary": {LOAD: spec}})
                for spec in ("lin(2000, 2400, 10000000)", "uniform(2000, 2400)")
                for together in (False, True)
            ),
            *(
                ({"vary": {key: given}}, {"vary": {key: f"[{number}, 1]"}})
                for number in ("9" * 30, "9" * 400)  # which no array holds
                for key, given in ((LOAD, "[2000, 2400]"), ("title", '["a", "b"]'))
            ),
            *(
                ({"vary": SAMPLE, "sample": 4}, {"study": change})
                for change in (
                    {"sample": 5},
                    {"sample": 8},
                    {"indices": True},
                    {"method": "soboll"},
                )
            ),
            *(
                ({"vary": ONE_KEY, "sample": 4}, {"vary": vary})
                for vary in ({LOAD: "[2000, 2100]"}, {LOAD: "lin(2000, 2100, 4)"}, {})
            ),
        ],
    ),
)
def test_a_study_that_is_not_that_of_its_file_is_refused_before_its_values_are_made(
    options: Any, changes: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(tmp_path / "s.h5", 1, **options)
    path = tmp_path / "s.partial.h5"
    table = read_sweep(path)
    study = tomllib.loads(table.attributes["study"])
    study["study"] |= changes.get("study", {})
    study["vary"] = changes.get("vary", study["vary"])
    coordinates = table.coordinates if study["vary"] else {}
    before = altered(path, {"study": tomli_w.dumps(study)}, coordinates=coordinates)
    monkeypatch.delattr(sweeping, "run_blocks")
    monkeypatch.delattr(values, "_evenly")
    with pytest.raises(fs.InputError, match="its study is not that of its values"):
        fs.resume_sweep(path, workers=1)
    assert path.read_bytes() == before


def test_a_sweep_over_integers_that_no_array_holds_is_resumed(tmp_path: Path) -> None:
    steps, huge = "solver.max_steps", 10**400
    sweep(tmp_path / "s.h5", vary={steps: [huge, 10_000_000]})
    swept = fs.open_sweep(tmp_path / "s.h5")[steps]
    assert swept.values.tolist() == [str(huge), "10000000"]
    interrupted(tmp_path / "t.h5", 1, vary={steps: [huge, 10_000_000]})
    fs.resume_sweep(tmp_path / "t.h5", workers=1)
    assert (tmp_path / "t.h5").read_bytes() == (tmp_path / "s.h5").read_bytes()


def test_a_full_disk_keeps_what_is_done_and_says_how_to_continue(
    whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, written, write = tmp_path / "s.h5", [], sweep_files.write_sweep

    def full(table: Any, place: Path) -> None:
        if written:
            raise fs.OutputError(f"{place}: cannot write the sweep: No space left on device")
        written.append(place)
        write(table, place)

    with monkeypatch.context() as patch:
        patch.setattr(sweep_files, "write_sweep", full)
        with pytest.raises(
            fs.OutputError, match=r"No space left.*'frictionsim resume .*s\.partial\.h5'"
        ):
            sweep(path)
    fs.resume_sweep(path, workers=1)
    assert path.read_bytes() == whole
    assert os.listdir(tmp_path) == ["s.h5"]


LOST = "dask tcp://there: lost the connection to the scheduler"


@pytest.mark.parametrize("error", [ZeroDivisionError("of the user"), fs.SolverError(LOST)])
def test_an_error_in_a_sweep_and_a_lost_scheduler_keep_what_is_done(
    error: Exception, whole: bytes, tmp_path: Path
) -> None:
    path, part = tmp_path / "s.h5", partial_name(tmp_path / "s.h5")

    def fail(step: SweepProgress) -> None:
        if step.done == 3:
            raise error

    with pytest.raises(type(error)) as caught:
        sweep(path, progress=fail)
    if isinstance(error, ZeroDivisionError):
        assert caught.value is error
        reason = "stopped by an error (ZeroDivisionError) after 3 of 12 runs"
        assert fs.open_sweep(path).attrs["reason"] == reason
    else:
        assert (caught.value.exit_code, str(caught.value)) == (  # type: ignore[attr-defined]
            5,
            f"{LOST}. sweep interrupted: 3 of 12 runs are saved in {part};"
            f" 'frictionsim resume {part}' continues the sweep",
        )
    fs.resume_sweep(path, workers=1)
    assert path.read_bytes() == whole


def test_a_sweep_that_another_program_has_changed_is_resumed_elsewhere(
    whole: bytes, tmp_path: Path
) -> None:
    interrupted(tmp_path / "s.h5")
    path = partial_name(tmp_path / "s.h5")
    path.write_bytes(path.read_bytes()[:-LENGTH])
    with pytest.raises(fs.OutputError) as refused:
        fs.resume_sweep(path, workers=1)
    assert str(refused.value) == (
        f"{path}: cannot write the sweep: the existing file was changed or made by another program"
        " (it has no checksum) and is not overwritten; give another name"
    )
    fs.resume_sweep(path, workers=1, output=tmp_path / "t.h5")
    assert (tmp_path / "t.h5").read_bytes() == whole
    assert path.exists()


def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    def press(step: SweepProgress) -> None:
        if step.done == 4:
            signal.raise_signal(signal.SIGINT)

    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt, match="of 12 runs are saved in"):
            sweep(tmp_path / "s.h5", progress=press)
    finally:
        signal.signal(signal.SIGINT, handler)
    assert 4 <= int((fs.open_sweep(tmp_path / "s.h5")["status"] == 1).sum()) < 12


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the worker is a copy with another function")
def test_a_long_run_is_left_when_a_sweep_is_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(step: SweepProgress) -> None:
        if step.checked == step.total:
            raise SweepInterrupted(signal.SIGTERM)

    monkeypatch.setattr(executors, "may_fork", lambda: True)
    monkeypatch.setattr(dispatch, "run_task", lambda *_: time.sleep(600.0))
    begun = time.monotonic()
    with pytest.raises(SweepInterrupted, match="0 of 2 runs are saved"):
        sweep(tmp_path / "s.h5", vary={LOAD: [2000.0, 2100.0]}, workers=2, progress=stop)
    assert time.monotonic() - begun < 20.0


def test_series_are_kept_and_resumed(tmp_path: Path) -> None:
    path, folder = tmp_path / "s.h5", tmp_path / "s.series"
    interrupted(path, 2, keep_series=True, vary={LOAD: [2000.0, 2100.0, 2200.0]})
    assert sorted(os.listdir(folder)) == ["run-0000000.h5", "run-0000001.h5", "study.toml"]
    elsewhere = folder.rename(tmp_path / "elsewhere")
    with pytest.raises(fs.InputError, match="put it back beside the sweep"):
        fs.resume_sweep(path, workers=1)
    assert not folder.exists()
    elsewhere.rename(folder)
    stamp = (folder / "run-0000000.h5").stat().st_mtime_ns
    swept = fs.resume_sweep(path, workers=1)
    assert (folder / "run-0000000.h5").stat().st_mtime_ns == stamp
    result = fs.open(folder / "run-0000002.h5")
    assert len(result.dataset["time"]) > 100
    assert float(result.quantities["final_angle"]) == float(swept["final_angle"][2])
    plain = fs.sweep(PULLEY, {LOAD: [2000.0, 2100.0, 2200.0]}, LOOSE, workers=1)
    assert np.array_equal(plain["final_angle"], swept["final_angle"])
    with pytest.raises(fs.OutputError, match="it is not a folder of the same study; move it"):
        sweep(path, keep_series=True)
    assert path.exists()


def test_no_result_of_a_run_is_written_through_a_link(tmp_path: Path) -> None:
    path, folder = tmp_path / "s.h5", tmp_path / "s.series"
    interrupted(path, 1, keep_series=True, vary={LOAD: [2000.0, 2100.0]})
    other, content = tmp_path / "other.h5", (folder / "run-0000000.h5").read_bytes()
    other.write_bytes(content)  # any other file than a result is not replaced
    (folder / "run-0000001.h5").symlink_to(other)
    with pytest.raises(fs.OutputError) as refused:
        fs.resume_sweep(path, workers=1)
    assert str(refused.value).startswith(
        f"{folder / 'run-0000001.h5'}: cannot write the result: this is a link; remove it,"
        " or give another name. sweep interrupted: 1 of 2 runs are saved in"
    )
    assert other.read_bytes() == content
    (folder / "run-0000001.h5").unlink()
    elsewhere = folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(elsewhere)
    for run in (fs.resume_sweep, partial(sweep, keep_series=True)):
        with pytest.raises(fs.OutputError) as refused:
            run(path, workers=1)
        assert str(refused.value) == (
            f"{folder}: the results of the runs would be written here, and this is a link; remove"
            " it, or give another name with -o"
        )
        partial_name(path).unlink(missing_ok=True)
    assert sorted(os.listdir(elsewhere)) == ["run-0000000.h5", "study.toml"]


def test_a_series_that_cannot_be_written_ends_the_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.h5"

    def full(*_: Any) -> None:
        raise fs.OutputError("no space")

    monkeypatch.setattr("frictionsim.io.hdf5_writer.write", full)
    with pytest.raises(fs.OutputError, match="no space"):
        sweep(path, keep_series=True)
    assert not fs.open_sweep(path)["status"].any()
    assert "killed" not in fs.open_sweep(path).attrs["reason"]
