"""Tables and the progress bar on a terminal; the only module that imports rich."""

import os
import sys
from functools import cache
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from frictionsim.io.comparison import Comparison
    from frictionsim.results import Check, Quantities, Transition
    from frictionsim.simulation.simulate import RunResult
    from frictionsim.work_precision.error_estimate import Estimate

DIGITS = 10
WIDTH = 1000
MODE_NAMES = {0: "stick", 1: "slip +", -1: "slip -"}
# Of more events, the table shows the first ones and the last.
MAX_EVENTS = 20


def print_run(run: "RunResult", output: str | None, estimate: "Estimate | None" = None) -> None:
    """Print the summary of a run on stdout.

    Parameters
    ----------
    run : RunResult
    output : str or None
        Path of the result file; None if none was written.
    estimate : Estimate, optional
        Errors of the quantities.
    """
    console = _console()
    title = run.scenario.title or run.scenario.kind
    effects = ", ".join(run.effects) or "none"
    law = f"law {run.scenario.law}, " if run.scenario.law else ""
    console.print(f"{title}: {run.status}")
    console.print(
        f"kind {run.scenario.kind}, effects {effects}, {law}backend {run.scenario.solver.backend}",
        markup=False,
    )
    print_quantities(run.quantities, estimate.errors if estimate else None)
    if estimate and estimate.errors:
        console.print(estimate.method)
    if run.transitions:
        _print_table(_transitions_table(run.transitions))
    _print_table(_audit_table(run.checks))
    statistics = run.statistics
    compiled = statistics.compile_seconds
    compilation = f" after {compiled:.3g} s of compilation" if compiled else ""
    console.print(
        f"solved in {statistics.wall_seconds:.3g} s{compilation}: {statistics.states} states,"
        f" {statistics.steps} steps, {statistics.rejected} rejected steps,"
        f" {statistics.rhs_evaluations} evaluations of the right-hand side"
        f" (including {run.time.size} samples)"
    )
    console.print(f"result: {output or 'none'}")


def print_quantities(
    quantities: "Quantities", errors: "dict[str, float | None] | None" = None
) -> None:
    """Print quantities with their units on stdout.

    Parameters
    ----------
    quantities : Quantities
    errors : dict of float or None, optional
        Adds a column of errors.
    """
    table = _table("quantity", ">value", *((">error",) if errors else ()), "unit")
    for name, quantity in quantities.items():
        error = (_error(errors.get(name)),) if errors else ()
        table.add_row(name, _number(quantity.value), *error, quantity.unit)
    _print_table(table)


def print_comparison(comparison: "Comparison") -> None:
    """Print the largest differences of two results on stdout."""
    table = _table("channel", ">largest difference", ">allowed", ">time / s", "")
    for row in comparison.rows:
        table.add_row(
            row.name,
            _short(row.difference),
            _short(row.allowed),
            "" if row.time is None else f"{row.time:.9g}",
            "ok" if row.ok else (row.note or "different"),
        )
    _print_table(table)
    console = _console()
    for note in comparison.notes:
        console.print(note)
    differing = sum(not row.ok for row in comparison.rows)
    verdict = f"{differing} of {len(comparison.rows)} differ" if differing else "the files agree"
    console.print(verdict)


def print_cells(headings: list[str], rows: list[list[str]]) -> None:
    """Print a table on stdout.

    Parameters
    ----------
    headings : list of str
        A leading '>' marks a column of numbers, aligned at the right.
    rows : list of list of str
    """
    table = _table(*headings)
    for cells in rows:
        table.add_row(*cells)
    _print_table(table)


def print_lines(*lines: str) -> None:
    """Print lines on stdout."""
    console = _console()
    for line in lines:
        console.print(line)


class ProgressBar:
    """Progress bar on stderr: simulated time, percentage, pace and remaining time."""

    def __init__(self, duration: float) -> None:
        from rich.progress import BarColumn, Progress, TextColumn

        self._progress = Progress(
            TextColumn("t = {task.completed:.4f} of {task.total:g} s"),
            BarColumn(),
            TextColumn("{task.percentage:.1f} %{task.fields[pace]}"),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._progress.add_task("", total=duration, pace="")
        self._duration = duration
        self._progress.start()

    def show(self, t: float, pace: float | None) -> None:
        """Update the bar.

        Parameters
        ----------
        t : float, s
            Simulated time.
        pace : float or None, s/s
            Wall time per simulated second, if known.
        """
        text = ""
        if pace is not None:
            left = pace * (self._duration - t)
            text = f", {pace:.3g} s per simulated second, {left:.0f} s left"
        self._progress.update(self._task, completed=t, pace=text)

    def close(self) -> None:
        """Remove the bar from the terminal."""
        self._progress.stop()


class _PipeConsole(Console):
    """A console that discards its output after the reader of its pipe has gone."""

    def on_broken_pipe(self) -> None:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())


@cache
def _console() -> Console:
    # No markup: titles and paths may contain brackets. A large width: numbers are never truncated.
    return _PipeConsole(highlight=False, markup=False, emoji=False, width=WIDTH)


def _print_table(table: Table) -> None:
    """Print a table without trailing blanks."""
    console = _console()
    with console.capture() as capture:
        console.print(table)
    for line in capture.get().splitlines():
        console.out(line.rstrip(), highlight=False)


def _table(*headings: str) -> Table:
    """Return an empty table; a heading with a leading '>' is that of a column of numbers."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in headings:
        right = heading.startswith(">")
        table.add_column(heading.lstrip(">"), justify="right" if right else "left", no_wrap=True)
    return table


def _transitions_table(transitions: list["Transition"]) -> Table:
    placed = any(transition.position is not None for transition in transitions)
    angle = (">angle / rad",) if placed else ()
    table = _table(">event", ">time / s", "contact", "from", "to", *angle)
    numbered = list(enumerate(transitions, start=1))
    if len(numbered) > MAX_EVENTS:
        shown, last = numbered[: MAX_EVENTS - 2], numbered[-1]
    else:
        shown, last = numbered, None
    for number, e in shown:
        table.add_row(*_transition_cells(number, e))
    if last:
        table.add_row("...")
        table.add_row(*_transition_cells(*last))
    return table


def _transition_cells(number: int, e: "Transition") -> tuple[str, ...]:
    modes = MODE_NAMES[e.mode_from], MODE_NAMES[e.mode_to]
    angle = () if e.position is None else (_number(e.position),)
    return (str(number), f"{e.time:.9f}", e.contact, *modes, *angle)


def _audit_table(checks: dict[str, "Check"]) -> Table:
    table = _table("audit", ">value", ">limit", "")
    for name, check in checks.items():
        verdict = "ok" if check.ok else "FAILED"
        table.add_row(name, _short(check.value), _short(check.limit), verdict)
    return table


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.{DIGITS}g}"


def _error(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def _short(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
