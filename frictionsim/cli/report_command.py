"""`frictionsim report`: an HTML file that shows results in a browser."""

from pathlib import Path
from typing import Annotated

import typer

import frictionsim as fs
from frictionsim.cli.app import NoClobber, ResultFile, app
from frictionsim.cli.messages import print_beside_files


@app.command()
def report(
    result: ResultFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Report in HTML. [RESULT.html]"),
    ] = None,
    no_clobber: NoClobber = False,
) -> None:
    """Write a report in one HTML file, which any browser shows without a network.

    Of the result of a run, of a sweep, or of a table of `cost` in HDF5 or CSV.
    """
    target = output or result.with_suffix(".html")
    print_beside_files(str(fs.report(result, target, no_clobber=no_clobber)))
