"""The commands: how they are declared, run and end.

A command is a thin layer over `import frictionsim`: it reads options, calls a function and prints.
Its docstring declares its options, and those that are given are the arguments of its function.
Heavy imports happen when a function is called, so that --help is fast.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext, redirect_stdout
from importlib import import_module
from inspect import Parameter, Signature, cleandoc
from io import StringIO
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from typer.core import TyperArgument, TyperCommand

from frictionsim.cli.terminal import exit_message, print_data, print_error
from frictionsim.errors import EXIT_BAD_INPUT, EXIT_DEFECT, EXIT_DONE, ArgumentError
from frictionsim.io.terminal import print_on_stderr
from frictionsim.version import __version__

Command = TypeVar("Command", bound=Callable[..., int | None])

# The commands of each module, in the order of the help.
MODULES = {
    "runs": ("solve", "resume", "check", "static"),
    "studies": ("cost", "fit", "sweep"),
    "files": ("show", "compare", "plot", "report", "new", "schema", "warm-up"),
}
HELP = {"-h", "--help", "--show-completion"}
# The commands of the modules that are imported, by name, each with its `NAMES`.
COMMANDS: dict[str, tuple[Callable[..., int | None], Mapping[str, str]]] = {}

# A row of a docstring: an argument, or the names of an option and its placeholder, and the help.
# One without help has options of several commands.
ROW = re.compile(r"^(\S.*?)(?: {2,}(.*(?:\n .*)*))?$", re.MULTILINE)
SHARED = {
    "SCENARIO": "Scenario in TOML, or the name of a shipped one; - reads the standard input.",
    "--set KEY=VALUE": "Override a key: solver.rtol=1e-6. May be repeated.",
    "--max-wall SECONDS": "Stop this part of the run after this wall time. [none]",
    "--max-steps N": "Stop this part of the run after so many steps. [none]",
    "-j, --workers N": "Run so many processes. [one for each core]",
    "--dask ADDRESS": "Run on a Dask cluster: tcp://host:8786, or local:N for N local workers.",
    "--no-clobber": "Replace no existing file (exit 4), except a resumed one.",
    "--json": "Print JSON.",
    "-q, --quiet": "Print no summary and no progress.",
    "-v, --verbose": "Log on stderr; -vv logs more.",
}
# The types of values, by their placeholder; others are texts.
TYPES: dict[str, type] = {
    **dict.fromkeys(("NUMBER", "SECONDS", "X"), float),
    **dict.fromkeys(("FILE", "RESULT", "GOLDEN"), Path),
    "N": int,
}
# Arguments of Python and their options, where these have another name.
NAMES = {"overrides": "set", "as_json": "json", "start": "from", "stop": "to"}


def command(**names: str) -> Callable[[Command], Command]:
    """Add a function to COMMANDS; `names` are options of its arguments that have other names."""

    def add(function: Command) -> Command:
        COMMANDS[function.__name__.replace("_", "-")] = function, NAMES | names
        return function

    return add


def _rows(text: str) -> Iterator[tuple[str, str]]:
    """Yield the spelling and the help of each argument and option of a docstring."""
    shared = {key.split(", ")[-1].split()[0]: (key, words) for key, words in SHARED.items()}
    for spelling, words in ROW.findall(text):
        if words:
            yield spelling, " ".join(words.split())
        else:
            yield from (shared[name] for name in spelling.split())


def _parameter(spelling: str, words: str, arguments: Mapping[str, str]) -> Parameter:
    """Return the parameter that typer makes an argument or an option of."""
    parts = spelling.replace(", ", " ").split()
    flags = [part for part in parts if part.startswith("-")]
    placeholder = "" if parts == flags else parts[-1]
    metavar = placeholder if flags else placeholder.strip("[].")
    name = flags[-1].removeprefix("--").replace("-", "_") if flags else metavar.lower()
    kind: Any = TYPES.get(metavar, str)
    default: Any = None
    more: dict[str, Any] = {}
    if flags and not placeholder:
        kind, default = bool, False
    if name == "verbose":
        kind, default, more = int, 0, {"count": True}
    if "May be repeated" in words or placeholder.endswith("..."):
        kind = list[kind]
    if not flags and not placeholder.startswith("["):
        default = Parameter.empty
    declared: Any = typer.Option if flags else typer.Argument
    info = declared(*flags, metavar=metavar or None, help=words, show_default=False, **more)
    annotation, name = Annotated[kind, info], arguments.get(name, name)
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _callback(
    function: Callable[..., int | None], rows: str, options: Mapping[str, str]
) -> Callable[..., int | None]:
    """Return a command as typer takes it; it passes on what is given, and names options."""

    def call(**values: Any) -> int | None:
        given = {k: v for k, v in values.items() if v is not None and v is not False}
        try:
            return function(**given)
        except ArgumentError as error:
            name = options.get(error.argument, error.argument)
            raise ArgumentError(name, error.text) from None

    arguments = {option: argument for argument, option in options.items()}
    parameters = [_parameter(*row, arguments) for row in _rows(rows)]
    call.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__.clear()
    return call


class _Command(TyperCommand):
    """A command whose help has arguments as the documents have: SCENARIO..., without types."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        names = [(one.required, name) for name, one in self._arguments]
        return ["[OPTIONS]", *(name if required else f"[{name}]" for required, name in names)]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        try:
            return super().parse_args(ctx, args)
        except typer.TyperException as error:  # an option without its value does not name it
            vars(error)["ctx"] = ctx
            raise

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


def _show_version(wanted: bool) -> None:
    if wanted:
        print_data(__version__)
        raise typer.Exit


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


def app_for(arguments: Sequence[str] = ()) -> typer.Typer:
    """Return the application with the command that is called; with all if none is named.

    To make all takes longer than to run one.
    """
    called = next((argument for argument in arguments if argument != "--debug"), "")
    modules = [module for module, commands in MODULES.items() if called in commands]
    for module in modules or MODULES:
        import_module(f"frictionsim.cli.{module}")
    app = typer.Typer(
        name="frictionsim",
        help="Simulate mechanisms governed by dry friction.",
        epilog="Exit codes: 0 done, 1 solver failed, fit out of reach or files differ, 2 bad input,"
        " 3 audit failed, 4 file not written, 5 a limit reached or a worker lost, 70 internal"
        " error, 129/130/143 interrupted.",
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,  # halves the start-up time of --help
        pretty_exceptions_enable=False,
    )
    app.callback(invoke_without_command=True)(_program)
    every = [command for commands in MODULES.values() for command in commands]
    for name in [called] if modules else every:
        function, names = COMMANDS[name]
        text, _, rows = cleandoc(function.__doc__ or "").rpartition("\n\n")
        app.command(name, help=text, cls=_Command)(_callback(function, rows, names))
    return app


def run_command_line(arguments: list[str]) -> int:
    """Run a command and return its exit code; errors are printed to stderr."""
    if "" in arguments:
        print_error(
            f"argument {arguments.index('') + 1} is empty: is a shell variable unset?"
            " Expected a command, an option or a file"
        )
        return EXIT_BAD_INPUT
    # Typer prints help itself, and would end with 1 after the reader of a pipe has gone.
    helped = StringIO()
    printed = redirect_stdout(helped) if HELP.intersection(arguments) else nullcontext()
    try:
        with printed:
            app = app_for(arguments)
            code = app(arguments, standalone_mode=False, prog_name="frictionsim")
        if helped.getvalue():
            print_data(helped.getvalue().removesuffix("\n"))
    except BaseException as error:
        message, code = exit_message(error)
        if code == EXIT_DEFECT and "--debug" in arguments:
            raise
        if message:
            print_error(message)
        return code
    return code if isinstance(code, int) else EXIT_DONE
