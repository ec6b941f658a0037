"""Help and version; tables of at most 100 columns. What is refused is in `tests/messages`."""

import re
from collections.abc import Iterator

import pytest

import frictionsim as fs
from frictionsim import errors
from tests.cli.conftest import Run
from tests.docs.pages import INVENTORY

COMMANDS = sorted(INVENTORY["commands"].keys() - {"frictionsim"})
REPEATED = {
    **dict.fromkeys(("solve", "check", "static", "cost"), "set"),
    "sweep": "vary set",
    "compare": "ignore",
    "plot": "view at channel unit",
    "fit": "free channel quantity over set sigma unit",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_help(command: str, told: Run) -> None:
    out, err = told(command, "--help")
    assert out.startswith(f"Usage: frictionsim {command} [OPTIONS]")
    assert ("-h, --help" in out, err, told(command, "-h")[0]) == (True, "", out)
    # Placeholders look alike; of what an option does, the default is the last.
    usage = out.partition("\n")[0].partition("[OPTIONS]")[2]
    assert re.fullmatch(r"( [A-Z]+(\.\.\.)?| \[[A-Z]+\])*", usage)
    placeholders = [word.strip("[]") for word in usage.split()]
    arguments, _, options = out.partition("\nArguments:\n")[2].partition("\nOptions:\n")
    # No types of Python are beside them.
    assert re.findall(r"^  (\S.*?)  ", arguments, re.MULTILINE) == placeholders
    assert "] May be repeated" not in " ".join(out.split())
    rows = re.split(r"\n  (?:-\w, )?--", options or out)
    said = [text.split()[0] for text in rows if "May be repeated." in " ".join(text.split())]
    assert [one.removeprefix("--") for one in said] == REPEATED.get(command, "").split()


def test_the_help_lists_every_exit_code(told: Run) -> None:
    out, err = told("--help")
    assert (out, err) == (told("-h")[0], "")
    words = " ".join(out.split())
    codes = {name: code for name, code in vars(errors).items() if name.startswith("EXIT_")}
    listed_codes = set(codes.values()) - {errors.EXIT_SIGNAL}
    assert listed_codes == {0, 1, 2, 3, 4, 5, 70}
    assert all(re.search(rf"\b{code} [a-z]", words) for code in listed_codes)
    assert "129/130/143 interrupted" in words
    assert told("--version")[0] == f"{fs.__version__}\n"
    for arguments in ([], ["--debug"]):
        assert told(*arguments, code=2)[1].startswith("Usage: frictionsim")


def test_colours_and_width_of_the_terminal_do_not_change_a_summary(
    told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    wide = told("static", "pulley")[0]
    for name, value in (("COLUMNS", "20"), ("NO_COLOR", "1"), ("FORCE_COLOR", "1"), ("TERM", "")):
        monkeypatch.setenv(name, value)
        assert told("static", "pulley")[0] == wide


# --- width of tables ------------------------------------------------------------------------

WIDTH = 100
LONG = "effects.viscous_damping.coefficient"
KEYS = {"effects.shaft_friction.mu_s": 0.2, LONG: 1.0, "mechanism.load": 2000.0}
CELLS = re.compile(r"\S {2,}\S.* {2,}\S")  # a line of a table of three columns or more


def assert_narrow(text: str) -> None:
    lines = [line for line in text.splitlines() if CELLS.search(line)]
    assert lines
    assert not [line for line in lines if len(line) > WIDTH]


@pytest.mark.parametrize("count", [2, 8])
def test_results_side_by_side_lose_no_value(count: int, told: Run) -> None:
    results = [
        fs.solve(
            "pulley",
            {"mechanism.load": 2000.0 + 10 * i, "effects.shaft_friction.mu_s": 0.2 + 0.01 * i},
            output=f"a_rather_long_name_of_a_result_{i}.h5",
        )
        for i in range(count)
    ]
    out, _ = told("show", *(str(result.path) for result in results))
    assert_narrow(out)
    for name in ("force_to_lift", "final_angle", "energy_input"):
        rows = [line.split() for line in out.splitlines() if line.startswith(f"{name} ")]
        shown = [cell for row in rows for cell in row[1:]]
        assert all(f"{result.quantities[name].value:.10g}" in shown for result in results)


def test_results_of_unlike_kinds_side_by_side(told: Run) -> None:
    """A part has the rows that one of its results has; lists end after a whole number."""
    kinds = ("pulley", "lift", "shaft", "epicyclic")
    for kind in kinds:
        told("solve", kind, "-q", "-o", f"{kind}.h5")
    out, _ = told("show", *(f"{name}.h5" for name in kinds))
    assert_narrow(out)
    lines = out.splitlines()
    assert lines[0].split() == ["key", *kinds[:2]]  # as far as the lines go
    for line in lines:
        assert set(line.split()[1:]) - {"\N{EM DASH}"}, line
        assert re.search(r"\d\.\.\.", line) is None
    # The audit is not turned: each check is a row, whatever the number of results.
    (audit,) = (i for i, line in enumerate(lines) if line.startswith("energy_balance "))
    assert lines[audit].count(" ok") == len(kinds)


def wide_tables(told: Run) -> Iterator[str]:
    vary = [f"--vary={key}=uniform({low}, {low * 1.1})" for key, low in KEYS.items()]
    options = ("--set", "solver.duration=0.5", "--set", "solver.rtol=1e-4", "-j", "1", "-o", "s.h5")
    yield told("sweep", "pulley", *vary, "--sample", "64", "--indices", *options)[0]
    fs.solve("lift", {"effects.shaft_friction.mu_k": 0.031}, output="a.h5")
    fs.solve("lift", {"effects.shaft_friction.mu_k": 0.1 / 3}, output="b.h5")
    yield told("compare", "a.h5", "b.h5", code=1)[0]
    options = ("--set", "solver.duration=1", "--set", "solver.max_steps=1000", "--repeats", "1")
    few = ("--tolerances", "1e-5", "--backends", "events,rk45")
    out, _ = told("cost", "pulley", *options, *few)
    assert re.search(r"^\w+, rk45, speed \S+: limit of 1000 steps reached", out, re.MULTILINE)
    yield out
    short = {"solver.duration": 0.8, "solver.rtol": 1e-5}
    fs.solve("pulley", short).save_csv("data.csv", ["angle", "angular_velocity"])
    free = [f"--free={key}={0.7 * low}:{1.5 * low}" for key, low in KEYS.items()]
    data = ("--data", "data.csv", "--channel", "angle", "--channel", "angular_velocity")
    options = ("--set", "solver.duration=0.8", "--set", "solver.rtol=1e-5", "--starts", "1")
    yield told("fit", "pulley", *free, *data, *options)[0]


def test_tables_of_sweeps_comparisons_costs_and_fits_are_narrow(told: Run) -> None:
    for number, text in enumerate(wide_tables(told)):
        assert_narrow(text)
        if number == 0:  # Sobol indices are in one part
            heading = next(one for one in text.splitlines() if one.startswith("Sobol indices of"))
            assert re.split("  +", heading)[2:] == [
                *("first-order", "95 % of first-order", "total", "95 % of total")
            ]
            assert len(re.findall(r"^final_angle  ", text, re.M)) == 1 + len(KEYS)
