"""What `frictionsim show` prints of a sweep."""

from contextlib import suppress

from frictionsim.api.opening import SweepFile
from frictionsim.cli.messages import print_error, print_json, print_text
from frictionsim.io.terminal import ReaderGone, Stdout


def show_sweep(
    sweep: SweepFile,
    *,
    as_json: bool = False,
    as_csv: bool = False,
    scenario: bool = False,
    study: bool = False,
) -> None:
    """Print the summary of a sweep, or what an option asks for instead.

    Parameters
    ----------
    sweep : SweepFile
    as_json, as_csv, scenario, study : bool
        The options of `frictionsim show`, of which at most one is true.
    """
    if scenario or study:
        print_text(sweep.toml("study" if study else "scenario"))
        return
    if as_json:
        print_json(sweep.to_json())
    elif as_csv:
        stdout = Stdout()
        with suppress(ReaderGone):
            sweep.write_csv(stdout)
            stdout.flush()
    else:
        print_text(sweep.summary())
    if sweep.left:
        print_error(sweep.left)
