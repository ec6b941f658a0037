"""Reading files in a child process with limits on time and memory.

HDF5 and SQLite may crash or hang on a file of someone else.

The child is a new interpreter. It reads one question from stdin, see `child_questions`, and writes
the answer to stdout, see `child_answer`. `start` makes it import its modules while this process
imports others. It contains crashes and endless loops, but is no sandbox: it has all rights of the
user.
"""

import math
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError

if TYPE_CHECKING:
    import subprocess

SECONDS = 7.0  # limit for a small file, which takes some hundredths
BYTES_PER_SECOND = 20e6  # of a large file, on a busy machine
BYTES_PER_SECOND_IN_PARTS = 2e6  # of a file whose samples are read in parts, all parts together
MEMORY = 2 << 30  # bytes of address space, if the system can limit them
OUT_OF_MEMORY = 3  # exit code
SEPARATOR = b"\0"
# With the folder of the package, which an editable installation may not have on its path.
CODE = """\
import sys
sys.path[:] = {path!r}
from frictionsim.io.child_questions import serve
serve()
"""
# One thread: a thread for each core takes time and address space, and reading has no matrices. No
# lock: files are replaced as a whole, and some file systems and other programs do not grant one.
ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "HDF5_USE_FILE_LOCKING": "FALSE",
}
PATH = str(Path(__file__).parents[2])

_waiting: "list[subprocess.Popen[bytes]]" = []


class ChildFailed(Exception):
    """The child has not answered; the message is the reason, to follow a colon."""


class EndedFromOutside(ChildFailed):
    """Another process or the system has ended the child, whatever the file."""


class Parts:
    """The parts of a result or journal of some size in bytes, which are read one by one.

    The time for all of them is limited if `are_limited`, as in a process of one command: a file of
    1 MB can hold 1 GB of samples. A session in Python may read a file again and again, and its user
    can end it.
    """

    are_limited = False

    def __init__(self, size: int) -> None:
        self._allowed = SECONDS + size / BYTES_PER_SECOND_IN_PARTS
        self._free = self._allowed if self.are_limited else math.inf  # s

    def answer_of(self, question: str, *arguments: str | int, size: int) -> Any:
        """Return the answer to a question about a part, as the function of this name."""
        start = monotonic()
        try:
            return answer_of(question, *arguments, size=size, seconds=self._free)
        except ChildFailed:
            if monotonic() - start < self._free:
                raise
            raise ChildFailed(
                f"all parts of it take longer than {self._allowed:.0f} s, the limit of a command"
                " for a file of this size; the functions of Python have none"
            ) from None
        finally:
            self._free -= monotonic() - start


def start(count: int) -> None:
    """Start children ahead of the first questions."""
    with suppress(OSError):  # `_next` reports it at the first question
        _waiting.extend(_started() for _ in range(count))


def answer_of(
    question: str, *arguments: str | int, size: int = 0, seconds: float = math.inf
) -> Any:
    """Return the answer to a question about a file of some size in bytes, within some time.

    Raises InputError as the child does, and ChildFailed if it crashed, exceeded its time or memory,
    or was ended.
    """
    from subprocess import TimeoutExpired

    from frictionsim.io.child_answer import decoded

    seconds = min(seconds, SECONDS + size / BYTES_PER_SECOND)
    text = SEPARATOR.join(os.fsencode(str(part)) for part in (seconds, question, *arguments))
    with _next() as process:
        try:
            answer, _ = process.communicate(text, timeout=seconds)
        except TimeoutExpired:
            raise ChildFailed(
                f"{_library(question)} did not finish within {seconds:.0f} s: the file is corrupt"
                " or malicious, or its disk does not answer"
            ) from None
        finally:
            process.kill()  # no effect on a child that has ended
    if process.returncode:
        raise _failed(process.returncode, question)
    try:
        return decoded(answer)
    except InputError:
        raise
    except Exception:  # any error of numpy: HDF5 may have damaged the child
        raise _failed(1, question) from None


def _next() -> "subprocess.Popen[bytes]":
    """Return a child that waits for a question."""
    with suppress(IndexError):  # another thread may take the last one
        return _waiting.pop()
    try:
        return _started()
    except OSError as error:
        reason = error.strerror or error
        raise ChildFailed(f"no process can be started to read it in: {reason}") from None


def _started() -> "subprocess.Popen[bytes]":
    import subprocess  # takes some ms, and commands that only write do not need it

    path = [*(entry for entry in sys.path if isinstance(entry, str)), PATH]
    options = ["-I", "-S", "-W", "ignore", *(["-B"] if sys.dont_write_bytecode else [])]
    return subprocess.Popen(
        [sys.executable, *options, "-c", CODE.format(path=path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **ENVIRONMENT},
        start_new_session=True,  # Ctrl-C goes to this process, which decides
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )


def _library(question: str) -> str:
    return "SQLite" if question.startswith("journal") else "HDF5"


def _failed(code: int, question: str) -> ChildFailed:
    """Return the error of a child that has not answered, by its exit code."""
    harmful = "the file is corrupt or malicious"
    if code == OUT_OF_MEMORY:
        return ChildFailed(f"it takes more than {MEMORY >> 30} GiB of memory: {harmful}")
    name = ""
    with suppress(ValueError):
        name = signal.Signals(-code).name
    if name in ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP"):
        return EndedFromOutside(
            f"the process that reads it was ended from outside ({name}), as by a system that is"
            " short of memory; try again"
        )
    crash = f"{_library(question)} crashed on it{f' ({name})' if name else ''}"
    return ChildFailed(f"{crash}: {harmful}")
