"""The child process that reads: its answers, its limits and its failures."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import InputError
from frictionsim.io import child_process
from frictionsim.io.child_answer import Checkpoint, Refusal, decoded, encoded
from frictionsim.io.child_process import ChildFailed, EndedFromOutside, answer_of
from frictionsim.results import Quantity
from tests.support.cases import slow
from tests.support.old_results import old_result
from tests.support.scenarios import ROOT, pulley, python, simulate

HARMFUL = "the file is corrupt or malicious"


@pytest.fixture
def result(here: Path) -> str:
    from frictionsim.io import hdf5_writer

    hdf5_writer.write(simulate(pulley(output__interval=0.5)), Path("a.h5"))
    return "a.h5"


@pytest.fixture
def child_that(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Have the next children do something else than to answer."""

    def does(code: str) -> None:
        start = f"import sys; sys.stdin.buffer.read(); import os, signal, time; {code}"
        monkeypatch.setattr(child_process, "CODE", start.replace("{", "{{").replace("}", "}}"))

    return does


LEAVES = st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text()


@given(
    st.recursive(
        LEAVES | st.just(np.arange(6, dtype=np.int8).reshape(2, 3)),
        lambda inner: (
            st.lists(inner)
            | st.lists(inner).map(tuple)
            | st.dictionaries(st.text() | st.integers(), inner)
            | st.builds(Quantity, inner, inner)
            | st.builds(Checkpoint, inner, inner)
        ),
        max_leaves=12,
    )
)
def test_an_answer_is_as_it_was(value: Any) -> None:
    copy = decoded(encoded(value))
    np.testing.assert_equal(copy, value)
    assert type(copy) is type(value)


def test_a_refusal_is_an_error() -> None:
    with pytest.raises(InputError, match="because"):
        decoded(encoded(Refusal("because")))


@pytest.mark.parametrize("waiting", [0, 1])
def test_a_child_reads_a_result(waiting: int, result: str) -> None:
    child_process.start(waiting)
    content = answer_of("content", result)
    assert content.attributes["status"] == "done"
    assert np.array_equal(answer_of("rows", result, "angle", 1, 3), content.channels["angle"][1:3])
    content.channels["angle"][0] = 1.0  # it is as any array
    assert child_process._waiting == []


def test_pickled_arrays_are_no_answer(result: str, child_that: Callable[[str], None]) -> None:
    child_that(
        "import numpy, io; f = io.BytesIO();"
        " numpy.savez(f, tree=numpy.array([{}], dtype=object)); os.write(1, f.getvalue())"
    )
    with pytest.raises(ChildFailed, match="HDF5 crashed on it"):
        answer_of("content", result)


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("os.kill(os.getpid(), signal.SIGSEGV)", f"HDF5 crashed on it (SIGSEGV): {HARMFUL}"),
        ("os._exit(0)", f"HDF5 crashed on it: {HARMFUL}"),  # without an answer
        ("os.write(1, b'PK'); os._exit(0)", f"HDF5 crashed on it: {HARMFUL}"),
        ("os._exit(3)", f"it takes more than 2 GiB of memory: {HARMFUL}"),
        (
            "os.kill(os.getpid(), signal.SIGKILL)",
            "the process that reads it was ended from outside (SIGKILL), as by a system that is"
            " short of memory; try again",
        ),
    ],
)
def test_a_child_without_an_answer_is_an_error(
    code: str, said: str, child_that: Callable[[str], None], capfd: pytest.CaptureFixture[str]
) -> None:
    child_that(code)
    with pytest.raises(ChildFailed) as failed:
        answer_of("content", "a.h5")
    assert str(failed.value) == said
    assert isinstance(failed.value, EndedFromOutside) is (HARMFUL not in said)
    assert capfd.readouterr() == ("", "")


def test_a_child_that_does_not_end_is_ended(
    child_that: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(child_process, "SECONDS", 0.5)
    child_that("time.sleep(100.0)")
    started: list[Any] = []
    popen = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[0]
    )
    with pytest.raises(ChildFailed, match="HDF5 did not finish within 0 s"):
        answer_of("content", "a.h5")
    assert started[0].poll() == -signal.SIGKILL


def test_memory_is_limited(result: str, monkeypatch: pytest.MonkeyPatch) -> None:
    code = child_process.CODE.replace(
        "serve()",
        "import numpy\n"
        "from frictionsim.io import child_questions\n"
        "child_questions.QUESTIONS['content'] = lambda path: numpy.ones(2**28)\nserve()",
    )
    monkeypatch.setattr(child_process, "CODE", code)
    with pytest.raises(ChildFailed, match="it takes more than 2 GiB of memory"):
        answer_of("content", result)


def test_what_stops_this_process_does_not_end_the_child(result: str) -> None:
    """Ctrl-C goes to all processes of a terminal's group; the child is in another one."""
    child_process.start(1)
    assert os.getpgid(child_process._waiting[0].pid) != os.getpgid(0)
    assert answer_of("content", result).attributes["status"] == "done"


def test_children_are_asked_from_any_thread(result: str) -> None:
    answers: list[Any] = []
    threads = [
        threading.Thread(target=lambda: answers.append(answer_of("content", result)))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(answers) == 2


def test_a_file_that_another_program_has_locked_is_read(result: str) -> None:
    fcntl = pytest.importorskip("fcntl")
    with open(result, "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert answer_of("content", result).attributes["status"] == "done"


def test_a_command_that_reads_does_not_import_hdf5(result: str) -> None:
    code = (
        "import sys, os; sys.argv = ['frictionsim', 'show', 'a.h5']\n"
        "from frictionsim import __main__\n"
        "os._exit = lambda code: None\n"
        "__main__.main(); assert 'h5py' not in sys.modules"
    )
    done = python("-c", code, cwd=Path())
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("closed", ["<&- >&- 2>&-", slow(">&-")])
def test_closed_streams_do_not_matter(closed: str, result: str) -> None:
    code = (
        "from frictionsim.io.child_process import answer_of; import pathlib;"
        " pathlib.Path('said').write_text(answer_of('content', 'a.h5').attributes['status'])"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = f"exec '{sys.executable}' -c \"{code}\" {closed}"
    subprocess.run(command, shell=True, check=True, timeout=60, env=environment)
    assert Path("said").read_text() == "done"


def test_no_interpreter_is_told(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("a.h5").write_bytes(old_result())
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(ChildFailed, match="no process can be started to read it in: No such file"):
        answer_of("content", "a.h5")
