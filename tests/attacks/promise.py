"""What every case of an attack is held to."""

import contextlib
import io

from frictionsim.cli.commands import run_command_line

LEGAL = {
    "check": {0, 2},
    "static": {0, 2},
    "solve": {0, 1, 2, 3, 4, 5},
    "compare": {0, 1, 2},
    "plot": {0, 2, 4},
    "report": {0, 2, 4},
    "resume": {0, 1, 2, 3, 4, 5},
    "show": {0, 2},
    "sweep": {0, 2, 4},
    "cost": {0, 1, 2, 4, 5},
}
# In messages; a case has two gigabytes (`campaign.MEMORY`), and none may need more.
BROKEN_BY = ("Traceback", "out of memory")


class BrokenPromise(Exception):
    """A traceback, an undocumented exit code, a file lost; the message has all to see it again."""


def outcome(arguments: list[str], description: str) -> str:
    """Run the command line in this process; return its exit code as text.

    Raises
    ------
    BrokenPromise
        If the exit code is not a documented one, an error has no message, or memory ran out; with
        the description of the case.
    """
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run_command_line(arguments)
    captured = err.getvalue()
    legal = code in LEGAL[arguments[0]] and not any(words in captured for words in BROKEN_BY)
    said = code == 0 or captured.startswith("frictionsim: ") or arguments[0] == "compare"
    if legal and said:
        return f"exit {code}"
    raise BrokenPromise(f"{arguments}: exit {code}, {captured!r:.2000}\n{description}")
