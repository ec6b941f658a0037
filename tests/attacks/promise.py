"""What every case of an attack is held to."""

import contextlib
import io
import re

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
    "fit": {0, 1, 2, 4, 5},
    "cost": {0, 1, 2, 4, 5},
}
# What is said, and the codes that go with it: as warnings of a run that goes on, no message counts.
MEANT = {
    r"(cannot write the|cannot replace the|--no-clobber forbids)": {4},
    r"(cannot read this|cannot resume this|is not valid|not valid TOML|expected )": {2},
    r"run (failed|interrupted): ": {1, 5},
    r"self-audit failed": {3},
}
# In messages; a case has two gigabytes (`campaign.MEMORY`), and none may need more.
BROKEN_BY = ("Traceback", "out of memory")


class BrokenPromise(Exception):
    """A traceback, an undocumented exit code, a file lost; the message has all to see it again."""


def outcome(arguments: list[str], description: str, secret: str = "") -> str:
    """Run the command line in this process; return its exit code as text.

    Raises
    ------
    BrokenPromise
        If the exit code is not a documented one, or not that of the message, an error has no
        message, memory ran out, or a secret is told; with the description of the case.
    """
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run_command_line(arguments)
    captured = err.getvalue()
    legal = code in LEGAL[arguments[0]] and not any(words in captured for words in BROKEN_BY)
    said = code == 0 or captured.startswith("frictionsim: ") or arguments[0] == "compare"
    told = secret and secret in captured + out.getvalue()
    if legal and said and is_meant(code, captured) and not told:
        return f"exit {code}"
    raise BrokenPromise(f"{arguments}: exit {code}, {captured!r:.2000}\n{description}")


def is_meant(code: int, captured: str) -> bool:
    """Return whether an exit code matches the last message, if its words determine one."""
    if code == 0:
        return True
    lines = [line for line in captured.splitlines() if not line.startswith("frictionsim: warning")]
    of_message = [codes for words, codes in MEANT.items() if lines and re.search(words, lines[0])]
    return not of_message or any(code in codes for codes in of_message)
