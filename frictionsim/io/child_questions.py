"""The questions that the child process of `child_process` answers, and its limits.

Only this module imports the readers of HDF5; the process that asks does not.
"""

import gc
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from math import ceil
from typing import Any, NoReturn

import h5py

from frictionsim.errors import InputError
from frictionsim.io.child_answer import Refusal, encoded
from frictionsim.io.child_process import MEMORY, OUT_OF_MEMORY, SEPARATOR
from frictionsim.io.cost_content import COST, costs
from frictionsim.io.hdf5_content import channels, checkpoint, record, rows, samples
from frictionsim.io.journal_content import journal_origin, journal_part
from frictionsim.io.sweep_content import sweep
from frictionsim.io.sweep_table import VERSION_NAME as SWEEP_VERSION


def content(path: str) -> Any:
    """Return the content of a file: of the result of a run, a sweep or a table of costs."""
    reader: Callable[[str], Any] = record  # reports the fault of any other file
    with suppress(OSError), h5py.File(path, "r") as file:
        if SWEEP_VERSION in file.attrs:
            reader = sweep
        elif file.get(COST, getlink=True) is not None:
            reader = costs
    return reader(path)


QUESTIONS: dict[str, Callable[..., Any]] = {
    "content": content,
    "checkpoint": checkpoint,
    "rows": rows,
    "samples": samples,
    "channels": channels,
    "journal_origin": journal_origin,
    "journal_part": journal_part,
}


def serve() -> NoReturn:
    """Answer the question on stdin, and end the process without cleanup."""
    code = 1
    try:
        gc.disable()
        _limit_resources()
        seconds, question, *arguments = map(os.fsdecode, sys.stdin.buffer.read().split(SEPARATOR))
        output = os.dup(1)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):  # keep the output of libraries out of the answer
            os.dup2(nowhere, stream)
        if hasattr(signal, "alarm"):  # ends a child whose parent has died
            signal.alarm(ceil(float(seconds)) + 1)
        with open(output, "wb") as file:
            file.write(answer(question, *arguments))
        code = 0
    except MemoryError:
        code = OUT_OF_MEMORY
    finally:
        os._exit(code)


def answer(question: str, *arguments: str) -> bytes:
    """Return the bytes of the answer to a question."""
    reply: Any
    try:
        reply = QUESTIONS[question](*arguments)
    except InputError as error:
        reply = Refusal(str(error))
    return encoded(reply)


def _limit_resources() -> None:
    try:
        import resource
    except ImportError:  # Windows
        return
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError, ValueError, AttributeError):
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        if soft == resource.RLIM_INFINITY or soft > MEMORY:
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, hard))
