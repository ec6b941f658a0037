"""Exceptions and exit codes of the command line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from re import split
from signal import SIGINT, Signals
from typing import Any

EXIT_DONE = 0
EXIT_SOLVER_FAILED = 1
EXIT_DIFFERENT = 1
EXIT_BAD_INPUT = 2
EXIT_AUDIT_FAILED = 3
EXIT_NOT_WRITTEN = 4
EXIT_BUDGET_EXCEEDED = 5
EXIT_DEFECT = 70  # internal error: EX_SOFTWARE of sysexits.h
EXIT_SIGNAL = 128  # plus the signal number, as in shells: 130, 143


class FrictionsimError(Exception):
    """An error with a message for the user and the exit code of the process."""

    exit_code = EXIT_DEFECT


class InputError(FrictionsimError):
    """An invalid command line or input file."""

    exit_code = EXIT_BAD_INPUT

    def __init__(self, *args: Any, key: str = "") -> None:
        super().__init__(*args)
        self.key = key  # of a study, which is at fault


class ArgumentError(InputError):
    """An invalid argument of a function, which is an option of the command line.

    Attributes
    ----------
    argument : str
        Its name in Python; the option has dashes.
    text : str
    """

    def __init__(self, argument: str, text: str) -> None:
        super().__init__(argument, text)
        self.argument, self.text = argument, text

    def __str__(self) -> str:
        return f"{self.argument}: {self.text}"


class ScenarioError(InputError):
    """An invalid scenario; the message has one line for each fault."""

    def __init__(self, faults: list[str]) -> None:
        super().__init__(faults)
        self.faults = faults

    def __str__(self) -> str:
        return "\n".join(self.faults)


class SolverError(FrictionsimError):
    """A run that stopped before its end; the samples up to that time are valid.

    Each kind of failure has a class, whose `failure` names it in result files and JSON.
    The message says at what time, in which contact or body, and what to try.
    """

    exit_code = EXIT_SOLVER_FAILED
    failure = ""


class NonFinite(SolverError):
    """A state or its derivative is infinite or not a number."""

    failure = "non_finite"


class Diverged(SolverError):
    """The kinetic energy far exceeds the energy input: the integration is unstable."""

    failure = "diverged"


class StepUnderflow(SolverError):
    """The tolerances require a step below the floating-point resolution of the time."""

    failure = "step_underflow"


class Chattering(SolverError):
    """Events accumulate at one time."""

    failure = "chattering"


class BudgetExceeded(SolverError):
    """The limit on steps or wall time is reached; the run can be resumed with a larger one."""

    exit_code = EXIT_BUDGET_EXCEEDED
    failure = "budget_exceeded"


class WorkerDied(SolverError):
    """A worker of a sweep was killed, or the scheduler of Dask is lost; a sweep can be resumed."""

    exit_code = EXIT_BUDGET_EXCEEDED


class BeltOffPulleys(SolverError):
    """The belt has come off its pulleys."""

    failure = "belt_off_pulleys"


class Interrupted(SolverError):
    """A run that was stopped by a signal, or by a function of its progress; it can be resumed."""

    def __init__(self, signal_number: int = SIGINT, time: float | None = None) -> None:
        at = "" if time is None else f" at t = {time:.9g} s"
        super().__init__(f"by {Signals(signal_number).name}{at}")
        self.exit_code, self.signal_number = EXIT_SIGNAL + signal_number, signal_number
        self._arguments: tuple[Any, ...] = signal_number, time

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._arguments, self.__dict__


OUT_OF_RANGE = (
    "a number exceeds the range of double precision; check the scenario for forces, lengths or"
    " inertias that are far too large or too small"
)


@contextmanager
def overflow_refused() -> Iterator[None]:
    """Return the context in which overflow is a fault of the scenario; other errors are ours."""
    try:
        yield
    except OverflowError as error:
        raise InputError(OUT_OF_RANGE) from error


class AuditError(FrictionsimError):
    """A run that is done, but whose self-audit failed: its numbers cannot be trusted."""

    exit_code = EXIT_AUDIT_FAILED


class OutputError(FrictionsimError):
    """A result that could not be written; an existing file is left unchanged."""

    exit_code = EXIT_NOT_WRITTEN


def exit_code_of_interruption(reason: str) -> int:
    """Return the exit code of what was interrupted for a reason: that of the signal in it, or 1."""
    named = [signal for signal in Signals if signal.name in reason.split()]
    return EXIT_SIGNAL + named[0] if named else EXIT_SOLVER_FAILED


def failure_class(failure: str) -> type[SolverError]:
    """Return the exception of a kind of failure, as named in files; SolverError if of none."""
    classes = {each.failure: each for each in SolverError.__subclasses__() if each.failure}
    return classes.get(failure, SolverError)


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural where there are several: `2 keys`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def unknown(what: str, given: str, known: list[str], listed: str = "") -> str:
    """Return the message for an unknown name of a "backend" or "key" among those that are known.

    The closest is suggested; if none is close all are listed, or what is given in their place.
    """
    if near := closest(str(given), known):
        return f"unknown {what} '{given}' (did you mean '{near}'?)"
    listed = listed or f"known: {', '.join(known)}"
    return f"unknown {what} '{given}'; {listed}"


START = 3  # letters of a name that tell it


def closest(given: str, known: list[str]) -> str:
    """Return the known name of which another one is a misspelling; empty if there is none.

    A common ending, as of `hinge_friction` and `shaft_friction`, does not make one: the words
    before it must be alike. A name that lacks them is completed if there is one completion only;
    so is a start of some letters.
    """
    from difflib import get_close_matches  # imported here: needed for error messages only

    is_start = len(given) >= START
    completions = [name for name in known if is_start and name.startswith(given)]
    for name in get_close_matches(given, known, n=len(known) or 1):
        start, start_of_known = _without_common_ending(given, name)
        if not (start and start_of_known):
            completions.append(name)
        elif get_close_matches(start, [start_of_known]):
            return name
    return completions[0] if len(set(completions)) == 1 else ""


def _without_common_ending(first: str, second: str) -> tuple[str, str]:
    """Return two names without the words that both end with."""
    words, others = (split(r"[-_. ]", name.casefold()) for name in (first, second))
    while words and others and words[-1] == others[-1]:
        del words[-1], others[-1]
    return "_".join(words), "_".join(others)


def near_files(path: Path, suffixes: tuple[str, ...]) -> str:
    """Return what a message adds on a path that does not exist: a file with a name near to it.

    Of the files with these suffixes; empty if there is none.
    """
    from difflib import get_close_matches

    try:
        names = [file.name for file in path.parent.iterdir() if file.suffix in suffixes]
    except (FileNotFoundError, NotADirectoryError):
        return f" (there is no folder '{path.parent}')"
    except OSError:  # the folder may not be listed
        return ""
    near = get_close_matches(path.name, names, n=1)
    return f" (did you mean '{path.with_name(near[0])}'?)" if near else ""
