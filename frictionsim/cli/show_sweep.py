"""What `frictionsim show` prints of a sweep."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.cli.messages import print_error, print_json, print_text
from frictionsim.io.terminal import ReaderGone, Stdout
from frictionsim.parameter_study.block import NOT_RUN

if TYPE_CHECKING:
    from frictionsim.io.sweep_table import SweepTable


def show_sweep(
    table: "SweepTable",
    path: Path,
    *,
    as_json: bool = False,
    as_csv: bool = False,
    scenario: bool = False,
    study: bool = False,
) -> None:
    """Print the summary of a sweep, or what an option asks for instead.

    Parameters
    ----------
    table : SweepTable
    path : Path
        Its file.
    as_json, as_csv, scenario, study : bool
        The options of `frictionsim show`, of which at most one is true.
    """
    if scenario or study:
        print_text(table.attributes["study" if study else "scenario"].rstrip("\n"))
        return
    if as_json:
        from frictionsim.api.sweep_tables import sweep_json

        print_json(sweep_json(table, path))
    elif as_csv:
        from frictionsim.parameter_study.report import write_lines

        stdout = Stdout()
        with suppress(ReaderGone):
            write_lines(table, stdout)
            stdout.flush()
    else:
        from frictionsim.api.sweep_tables import sweep_parts
        from frictionsim.api.tables import as_text

        print_text(as_text(sweep_parts(table, path)))
    if table.attributes["status"] != "done":
        left = int((table.status == NOT_RUN).sum())
        print_error(
            f"sweep {table.attributes['status']}: {left} of {table.runs} runs are left:"
            f" {table.attributes['reason']}"
        )
