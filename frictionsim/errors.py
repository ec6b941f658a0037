"""The ways in which a command ends short of its purpose, each with its exit code."""

from signal import Signals

EXIT_DONE = 0
EXIT_SOLVER_FAILED = 1
EXIT_DIFFERENT = 1
EXIT_BAD_INPUT = 2
EXIT_AUDIT_FAILED = 3
EXIT_NOT_WRITTEN = 4
EXIT_BUDGET_EXCEEDED = 5
EXIT_DEFECT = 70  # the program itself is wrong: sysexits.h, EX_SOFTWARE
EXIT_SIGNAL = 128  # plus the number of the signal, as a shell has it: 130, 143


class FrictionsimError(Exception):
    """A message for the user; `exit_code` is what the process ends with."""

    exit_code = EXIT_DEFECT


class InputError(FrictionsimError):
    """A command line or an input file that cannot be used."""

    exit_code = EXIT_BAD_INPUT


class ScenarioError(InputError):
    """A scenario that cannot be simulated; the message names every fault, one a line."""

    def __init__(self, faults: list[str]) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults


class SolverError(FrictionsimError):
    """A run that stopped before its end; the samples up to there are good.

    Each way to fail has a class and a name of its own, `failure`; result files and JSON have it.
    A message says when, where - the contact or body - and what to do.
    """

    exit_code = EXIT_SOLVER_FAILED
    failure = ""


class NonFinite(SolverError):
    """A state or a rate is infinite or no number."""

    failure = "non_finite"


class Diverged(SolverError):
    """The motion has far more energy than was put in: the steps are unstable."""

    failure = "diverged"


class StepUnderflow(SolverError):
    """The tolerances ask for a step below the resolution of the time."""

    failure = "step_underflow"


class Chattering(SolverError):
    """Events follow each other without end."""

    failure = "chattering"


class BudgetExceeded(SolverError):
    """The steps or the seconds that a run may take are spent; with more it can go on."""

    exit_code = EXIT_BUDGET_EXCEEDED
    failure = "budget_exceeded"


class BeltOffPulleys(SolverError):
    """A belt has come off its pulleys."""

    failure = "belt_off_pulleys"


class Interrupted(SolverError):
    """A run that a signal stopped; it can go on from there."""

    def __init__(self, signal_number: int, time: float) -> None:
        super().__init__(f"by {Signals(signal_number).name} at t = {time:.9g} s")
        self.exit_code = EXIT_SIGNAL + signal_number


class OutputError(FrictionsimError):
    """A result that could not be written; what stood in its place before is untouched."""

    exit_code = EXIT_NOT_WRITTEN


def unknown(what: str, found: str, known: list[str]) -> str:
    """Return the sentence on a name that does not exist, with the nearest that does."""
    from difflib import get_close_matches  # only a mistake needs it

    near = get_close_matches(found, known, n=1)
    if near:
        return f"unknown {what} '{found}' (did you mean '{near[0]}'?)"
    return f"unknown {what} '{found}'; known: {', '.join(known)}"
