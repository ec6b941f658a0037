"""The application, how its commands are declared, options of several commands, and their files."""

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from inspect import cleandoc, signature
from os import sep
from os.path import exists, isdir
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_origin

import typer
from typer.core import TyperArgument, TyperCommand

import frictionsim as fs
from frictionsim.cli.printing import print_text
from frictionsim.errors import (
    EXIT_BAD_INPUT,
    ArgumentError,
    InputError,
    OutputError,
    ScenarioError,
)
from frictionsim.io.terminal import print_on_stderr
from frictionsim.version import __version__

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

STDIN = "-"
RESULTS = Path("results")  # the folder of results by default
Command = TypeVar("Command", bound=Callable[..., int | None])

# The commands of the modules that are imported, by name, each with its help.
COMMANDS: dict[str, tuple[Callable[..., int | None], str]] = {}

# In a docstring: the names of an option and its placeholder, two blanks, the help.
ROW = re.compile(r"^(\S+(?: \S+)*)  +(.*(?:\n .*)*)", re.MULTILINE)


class _Command(TyperCommand):
    """A command whose help has arguments as the documents have: SCENARIO..., without types."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        names = [(one.required, name) for name, one in self._arguments]
        return ["[OPTIONS]", *(name if required else f"[{name}]" for required, name in names)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        if rows := [(name, one.get_help_record(ctx)[1]) for name, one in self._arguments]:
            with formatter.section("Arguments"):
                formatter.write_dl(rows)
        options = (one for one in self.get_params(ctx) if not isinstance(one, TyperArgument))
        with formatter.section("Options"):
            formatter.write_dl([*filter(None, (one.get_help_record(ctx) for one in options))])

    @property
    def _arguments(self) -> list[tuple[str, Any]]:
        arguments = (one for one in self.params if isinstance(one, TyperArgument))
        return [(f"{one.metavar}{'...' * (one.nargs != 1)}", one) for one in arguments]


def command(function: Command) -> Command:
    """Add to COMMANDS a command, whose docstring has a row for each parameter, in their order.

    Parameters of several commands, as `Quiet`, bring names and help along.
    """
    text = cleandoc(function.__doc__ or "")
    own = [
        (name, parameter.annotation)
        for name, parameter in signature(function).parameters.items()
        if get_origin(parameter.annotation) is not Annotated
    ]
    if own:
        text, _, rows = text.rpartition("\n\n")
        for (name, kind), (spelling, words) in zip(own, ROW.findall(rows), strict=True):
            parts, words = spelling.replace(",", " ").split(), " ".join(words.split())
            flags = [part for part in parts if part.startswith("-")]
            metavar = spelling.split()[-1] if flags != parts else None
            declared: Any = typer.Option if flags else typer.Argument
            info = declared(*flags, metavar=metavar, help=words, show_default=False)
            function.__annotations__[name] = Annotated[kind, info]
    COMMANDS[function.__name__.replace("_", "-")] = function, text
    return function


ScenarioFile = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Scenario in TOML, or the name of a shipped one; - reads the standard input.",
        show_default=False,
    ),
]
OverridesOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Override a key: solver.rtol=1e-6. May be repeated."
    ),
]
MaxWall = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="Stop this part of the run after this wall time. [none]"),
]
MaxSteps = Annotated[
    int | None,
    typer.Option(metavar="N", help="Stop this part of the run after so many steps. [none]"),
]
WorkerCount = Annotated[
    int | None,
    typer.Option("-j", "--workers", metavar="N", help="Run so many processes. [one for each core]"),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--dask",
        metavar="ADDRESS",
        help="Run on a Dask cluster: tcp://host:8786.",
    ),
]
NoClobber = Annotated[
    bool,
    typer.Option("--no-clobber", help="Replace no existing file (exit 4), except a resumed one."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print no summary and no progress.")]
Verbose = Annotated[
    int,
    typer.Option(
        "--verbose", "-v", count=True, show_default=False, help="Log on stderr; -vv logs more."
    ),
]


def _show_version(wanted: bool) -> None:
    if wanted:
        print_text(__version__)
        raise typer.Exit


def app_with(commands: Iterable[str]) -> typer.Typer:
    """Return the application with some commands: to make all takes longer than to run one."""
    app = typer.Typer(
        name="frictionsim",
        help="Simulate mechanisms governed by dry friction.",
        epilog="Exit codes: 0 done, 1 solver failed or files differ, 2 bad input, 3 audit failed,"
        " 4 result not written, 5 step or time limit reached, 129/130/143 interrupted.",
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,  # halves the start-up time of --help
        pretty_exceptions_enable=False,
    )
    app.callback(invoke_without_command=True)(_program)
    for name in commands:
        function, text = COMMANDS[name]
        app.command(name, help=text, cls=_Command)(function)
    return app


def _program(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, help="Print the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Print the traceback of an internal error.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        print_on_stderr(context.get_help())
        raise typer.Exit(EXIT_BAD_INPUT)


def given(**options: Any) -> dict[str, Any]:
    """Return the options that are given; the others have the defaults of the function."""
    return {name: value for name, value in options.items() if value is not None}


@contextmanager
def named_by_option(options: Mapping[str, str]) -> Iterator[None]:
    """Return the context in which errors of arguments name options of other names."""
    try:
        yield
    except ArgumentError as error:
        raise ArgumentError(options.get(error.argument, error.argument), error.text) from None


def default_folder() -> Path:
    """Return the folder of results by default, which is made."""
    return _made(RESULTS, "give a file with -o")


def _made(folder: Path, way: str) -> Path:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        reason = "this is a file" if exists(folder) else error.strerror
        raise OutputError(f"cannot create the folder '{folder}' ({reason}); {way}") from None
    return folder


def stem_of(source: str) -> str:
    """Return the name of a result by default, without its suffix."""
    return "stdin" if source == STDIN else Path(source).stem


def load_scenario(
    source: str, overrides: list[str] | None = None, backend: str | None = None
) -> "Scenario":
    """Read and validate a scenario, as `frictionsim.load`; "-" is the standard input."""
    if source != STDIN:
        return fs.load(source, overrides, backend)
    from frictionsim.scenario.settings import STDIN as NAME
    from frictionsim.scenario.toml_data import NoUsableText, read_text

    if sys.stdin is None:
        raise InputError("-: the standard input is closed; expected a scenario in TOML")
    try:
        text = read_text(sys.stdin.buffer)
    except NoUsableText as error:
        raise ScenarioError([f"-: {error}"]) from None
    except UnicodeDecodeError as error:
        at = f"got invalid UTF-8 at byte {error.start}"
        raise ScenarioError(
            [f"-: expected a scenario in TOML on the standard input, {at}"]
        ) from None
    return fs.loads(text, overrides, backend, name=NAME)


def check_read_once(sources: Sequence[str]) -> None:
    """Check that the standard input is given once at most."""
    if sources.count(STDIN) > 1:
        raise InputError("-: given twice; the standard input can be read only once")


def scenarios_in(sources: Sequence[str]) -> list[str]:
    """Return the sources, with the scenarios of each folder instead of the folder."""
    scenarios = []
    for source in sources:
        is_folder = source != STDIN and isdir(source)
        inside = sorted(map(str, Path(source).rglob("*.toml"))) if is_folder else [source]
        if not inside:
            raise InputError(f"{source}: this folder has no scenario (*.toml)")
        scenarios += inside
    return scenarios


def targets_of(sources: Sequence[str], output: str | None, no_clobber: bool) -> list[Path]:
    """Return the result file of each scenario; of several it is checked that all can be written.

    The output is a folder, which exists or ends with a slash; for one scenario a file otherwise.
    The folder is made, if there is one to make it in.
    """
    if output == STDIN:
        raise InputError("-o -: a result is written as HDF5, not printed; give a file name")
    is_folder = output is None or output.endswith(("/", sep)) or isdir(output)
    if output is not None and len(sources) == 1 and not is_folder:
        return [Path(output)]
    folder = default_folder() if output is None else Path(output)
    targets: dict[Path, str] = {}
    for source in sources:
        target = folder / f"{stem_of(source)}.h5"
        if target in targets:
            raise InputError(
                f"{targets[target]} and {source} would both be written to {target}; solve them one"
                " by one, each with its -o"
            )
        targets[target] = source
    _made(folder, "give another folder with -o")
    if len(sources) > 1:
        from frictionsim.io.run_files import RunFiles

        for target in targets:
            RunFiles(target).check(no_clobber)
    return list(targets)
