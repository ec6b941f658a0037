"""Work in a child process with limits on time and memory: a library of C may crash or hang.

The child gets a copy of this process (`os.fork`, a few ms) where that is sound: on POSIX, in a
process with one Python thread. Elsewhere it is a new interpreter, which takes a fifth of a second.
Its limits are kept by the system, not by Python: SIGALRM ends the child also in a loop of C, and
also when its parent is gone. Where there is no SIGALRM, a watchdog thread of C ends it.

The child is no sandbox: it has all rights of the user. It contains crashes and endless loops.
"""

import gc
import os
import pickle
import signal
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import ceil
from time import monotonic
from typing import Any, NamedTuple, NoReturn

SECONDS_TO_START = 20  # of a new interpreter on a busy machine
LENGTH = struct.Struct("<Q")
MAX_BUFFERS = 100_000
# With a handler of Python or of `faulthandler` the child would print, or go on.
DEADLY = ("SIGSEGV", "SIGBUS", "SIGABRT", "SIGFPE", "SIGILL", "SIGALRM", "SIGXCPU", "SIGPIPE")
# Ctrl-C and a closed terminal go to this process and its child alike; this one decides.
TO_PARENT = ("SIGINT", "SIGTERM", "SIGHUP")
FROM_OUTSIDE = ("SIGKILL", *TO_PARENT)
CODE = """\
import sys
sys.path[:] = {path!r}
from frictionsim.io.child_process import main
main()
"""


class ChildLimits(NamedTuple):
    """What a child may take.

    Attributes
    ----------
    seconds, cpu_seconds : float, s
        An endless loop takes all the time there is, a slow disk takes none of the processor.
    memory : int
        Bytes of address space beyond those at its start, where the system can limit them; also
        of its answer.
    """

    seconds: float
    cpu_seconds: float
    memory: int


class ChildFailed(Exception):
    """The child has not answered; the message says why, to follow a colon."""


class EndedFromOutside(ChildFailed):
    """Another process or the system has ended the child, which says nothing of its work."""


class OutOfTime(ChildFailed):
    """The child has not come to an end in its time, and would not another time."""


def run_in_child(work: Callable[..., Any], arguments: tuple[Any, ...], limits: ChildLimits) -> Any:
    """Call a function in a child process; return its result.

    Returns
    -------
    object
        Large arrays are sent without being copied more than once.

    Raises
    ------
    ChildFailed
        If it crashed, took too long or too much memory, or was ended (`EndedFromOutside`).
    Exception
        That the function raised.
    """
    start = _fork if may_fork() else _interpreter
    begun = monotonic()
    try:
        answer, status = start(work, arguments, limits)
    except OSError as error:
        reason = error.strerror or error
        raise ChildFailed(f"no process can be started to read it in: {reason}") from None
    if answer is None and _name_of(status) in FROM_OUTSIDE:
        raise EndedFromOutside(
            f"the process that reads it was ended from outside ({_name_of(status)}), as by a system"
            " that is short of memory; try again"
        )
    if answer is None:
        raise _failed(status, monotonic() - begun, limits)
    returned, found = answer
    if returned:
        return found
    if found is None:
        raise ChildFailed(_out_of_memory(limits))
    raise found


def may_fork() -> bool:
    """Return whether a copy of this process is sound: another thread may hold a lock."""
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return False
    return only_one_thread() or not sys.executable


def only_one_thread() -> bool:
    """Return whether this process has one Python thread."""
    threading = sys.modules.get("threading")
    return threading is None or threading.active_count() == 1


Answer = tuple[tuple[bool, Any] | None, int | None]
"""What the child returned or raised, None if nothing; and how it ended, as of `subprocess`."""


def _fork(work: Callable[..., Any], arguments: tuple[Any, ...], limits: ChildLimits) -> Answer:
    import warnings

    read_end, write_end = os.pipe()
    process = None
    try:
        try:
            # Python 3.12 warns of threads, also of those of numpy's linear algebra, which do not
            # matter: the child uses none.
            with warnings.catch_warnings(), signals_wait():
                warnings.simplefilter("ignore", DeprecationWarning)
                process = os.fork()
                if process == 0:
                    os.close(read_end)  # else it could wait for itself to read its answer
                    _answer_and_exit(work, arguments, limits, write_end)
        finally:
            os.close(write_end)
        answer = _received(read_end, limits.memory)
    except BaseException:  # as KeyboardInterrupt, which may have waited for the end of the fork
        if process is not None:
            with suppress(OSError):
                os.kill(process, signal.SIGKILL)
            _status_of(process)
        raise
    finally:
        os.close(read_end)
    return answer, _status_of(process)


def _status_of(process: int) -> int | None:
    try:
        return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    except ChildProcessError:  # the program ignores SIGCHLD, or waits for all children itself
        return None


def _interpreter(
    work: Callable[..., Any], arguments: tuple[Any, ...], limits: ChildLimits
) -> Answer:
    import subprocess

    code = CODE.format(path=[entry for entry in sys.path if isinstance(entry, str)])
    with signals_wait():
        process = subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    assert process.stdin is not None
    assert process.stdout is not None
    with process.stdin, process.stdout:
        try:
            with suppress(OSError):  # it has ended already
                process.stdin.write(pickle.dumps((work, arguments, limits)))
                process.stdin.close()
            answer = _received(process.stdout.fileno(), limits.memory)
            process.stdout.close()  # what was not received ends the child
            return answer, process.wait()
        except BaseException:
            process.kill()
            process.wait()
            raise


@contextmanager
def signals_wait() -> Iterator[None]:
    """Return the context in which a child is started: `_isolate` has it ignore `TO_PARENT`.

    Until then they wait, in the child as here; here they come when the context ends.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    numbers = [getattr(signal, name) for name in TO_PARENT if hasattr(signal, name)]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def main() -> NoReturn:
    """Do what is asked for on stdin, as the new interpreter of `run_in_child`."""
    if hasattr(signal, "alarm"):
        signal.alarm(SECONDS_TO_START)
    work, arguments, limits = pickle.load(sys.stdin.buffer)
    _answer_and_exit(work, arguments, limits, os.dup(1))


def _answer_and_exit(
    work: Callable[..., Any], arguments: tuple[Any, ...], limits: ChildLimits, descriptor: int
) -> NoReturn:
    """Send what a function returns or raises, and end the process without any cleaning up."""
    try:
        _isolate(limits)
        descriptor = _without_streams(descriptor)
        found: tuple[bool, Any]
        try:
            found = True, work(*arguments)
        except MemoryError:
            found = False, None
        except Exception as error:
            found = False, error
        _send(descriptor, found)
        os._exit(0)
    finally:
        os._exit(1)


def _isolate(limits: ChildLimits) -> None:
    """Have the system end this process at its limits, and nothing of the parent react to it."""
    gc.disable()  # it would also finalize what is the parent's
    faulthandler = sys.modules.get("faulthandler")
    if faulthandler is not None:
        faulthandler.disable()
    with suppress(ValueError):  # not the main thread
        signal.set_wakeup_fd(-1)
        for number in signal.valid_signals():
            if callable(signal.getsignal(number)):
                signal.signal(number, signal.SIG_DFL)
        for name in DEADLY:
            if hasattr(signal, name):
                with suppress(OSError):
                    signal.signal(getattr(signal, name), signal.SIG_DFL)
        for name in TO_PARENT:
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, limits.seconds)  # ends in SIGALRM
    else:
        import faulthandler as watchdog

        with open(os.devnull, "wb") as nowhere:
            watchdog.dump_traceback_later(limits.seconds, exit=True, file=os.dup(nowhere.fileno()))
    _limit_resources(limits)


def _limit_resources(limits: ChildLimits) -> None:
    """Limit time of the processor (SIGXCPU) and address space; and write no core files."""
    try:
        import resource
    except ImportError:
        return
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError, ValueError, AttributeError):
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        resource.setrlimit(resource.RLIMIT_CPU, (ceil(limits.cpu_seconds), hard))
    with suppress(OSError, ValueError, AttributeError):
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        wanted = _address_space() + limits.memory
        if soft == resource.RLIM_INFINITY or wanted < soft:
            resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))


def _address_space() -> int:
    """Return the bytes of address space of this process; a usual number where it is not known."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 2 << 30


def _without_streams(descriptor: int) -> int:
    """Lead the standard streams nowhere; return the descriptor of the answer, which may be one."""
    lower = []
    while descriptor < 3:
        lower.append(descriptor)
        descriptor = os.dup(descriptor)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        if stream != nowhere:
            os.dup2(nowhere, stream)
    return descriptor


def _send(descriptor: int, found: tuple[bool, Any]) -> None:
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(found, protocol=5, buffer_callback=buffers.append)
    parts = [memoryview(head), *(buffer.raw() for buffer in buffers)]
    lengths = [LENGTH.pack(len(parts)), *(LENGTH.pack(part.nbytes) for part in parts)]
    for part in (memoryview(b"".join(lengths)), *parts):
        while part.nbytes:
            part = part[os.write(descriptor, part[: 1 << 24]) :]


def _received(descriptor: int, most: int) -> tuple[bool, Any] | None:
    """Return the answer of a child; None if it is not whole, or larger than a number of bytes."""
    with open(descriptor, "rb", buffering=0, closefd=False) as file:
        count = _number(file)
        if not 0 < count <= MAX_BUFFERS:
            return None
        lengths = [_number(file) for _ in range(count)]
        if min(lengths) < 0 or sum(lengths) > most:
            return None
        head, *buffers = (_bytes(file, length) for length in lengths)
    if head is None or any(buffer is None for buffer in buffers):
        return None
    try:
        return pickle.loads(head, buffers=[buffer for buffer in buffers if buffer is not None])
    except Exception:  # of a child whose memory HDF5 has damaged
        return None


def _number(file: Any) -> int:
    """Return the next number; -1 if there is none."""
    found = _bytes(file, LENGTH.size)
    return -1 if found is None else int(LENGTH.unpack(found)[0])


def _bytes(file: Any, length: int) -> bytearray | None:
    """Return so many bytes; None if there are fewer."""
    found = bytearray(length)
    left = memoryview(found)
    while left.nbytes:
        count = file.readinto(left)
        if not count:
            return None
        left = left[count:]
    return found


def _failed(status: int | None, seconds: float, limits: ChildLimits) -> ChildFailed:
    """Return why a child has not answered."""
    harmful = "the file is corrupt or malicious"
    if status is not None and -status == getattr(signal, "SIGXCPU", 0):
        within = f"{ceil(limits.cpu_seconds)} s"
        return OutOfTime(f"HDF5 did not come to an end within {within}: {harmful}")
    if seconds >= limits.seconds:
        return OutOfTime(
            f"HDF5 did not come to an end within {limits.seconds:.0f} s: {harmful}, or its disk"
            " does not answer"
        )
    name = _name_of(status)
    return ChildFailed(f"HDF5 crashed on it{f' ({name})' if name else ''}: {harmful}")


def _name_of(status: int | None) -> str:
    """Return the name of the signal that has ended a child; empty if none has."""
    with suppress(ValueError):
        return signal.Signals(-status).name if status is not None and status < 0 else ""
    return ""


def _out_of_memory(limits: ChildLimits) -> str:
    return (
        f"it takes more than {limits.memory / 1e6:.0f} MB of memory, far more than a result of its"
        " size: the file is corrupt or malicious"
    )
