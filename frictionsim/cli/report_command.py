"""`frictionsim report`: an HTML file that shows results in a browser."""

from pathlib import Path
from typing import Annotated

import typer

import frictionsim as fs
from frictionsim.cli.app import NoClobber, Quiet, app
from frictionsim.cli.messages import print_beside_files


@app.command()
def report(
    result: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT...",
            help="Result files in HDF5; several of one kind are compared.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Report in HTML. [RESULT.html, of the first]"
        ),
    ] = None,
    no_clobber: NoClobber = False,
    quiet: Quiet = False,
) -> None:
    """Write a report in one HTML file, which any browser shows without a network.

    Of the result of a run, several of one kind, a sweep, or a table of `cost` in HDF5 or CSV.
    """
    # What has no name, as a folder that is given as '/', is refused when it is read.
    target = output or result[0].parent / f"{result[0].stem or 'report'}.html"
    written = fs.report(list(result), target, no_clobber=no_clobber)
    if not quiet:
        print_beside_files(str(written))
