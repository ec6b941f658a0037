"""Signals from columns of CSV files: how columns are found, and what is refused."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from frictionsim.scenario.messages import error_message
from frictionsim.scenario.schema import Params, unit_field
from frictionsim.scenario.signal_tables import (
    PiecewiseLinearTable,
    SpeedOrTimeSignal,
    SpeedTable,
    TimeSignal,
)

pytestmark = pytest.mark.quick


class Drive(Params):
    force: TimeSignal = unit_field("N", "Force.")


class BeltDrive(Params):
    torque: SpeedOrTimeSignal = unit_field("N m", "Torque.")


def read(folder: Path, text: str | bytes, **keys: Any) -> PiecewiseLinearTable:
    """Return the signal of a file with keys beside `csv`."""
    content = text if isinstance(text, bytes) else text.encode()
    (folder / "log.csv").write_bytes(content)
    table = {"csv": "log.csv", **keys}
    return Drive.model_validate({"force": table}, context={"folder": folder}).force


def fault(folder: Path, text: str | bytes, **keys: Any) -> str:
    """Return the only fault of a file, without its folder."""
    with pytest.raises(ValidationError) as refused:
        read(folder, text, **keys)
    ((path, message),) = [error_message(error, Drive) for error in refused.value.errors()]
    return f"{'.'.join(map(str, path))}: {message}".replace(f"{folder}/", "")


ONE_LINE = (
    "csv: 'log.csv' has only one line with numbers, expected at least two; a constant signal is"
    " given as a number, here 1832.6, in the place of the file"
)
LOG = "t;n;F_N\n0,0;7;10,5\n0,5;8;20,5\n"
POINTS = ((0.0, 0.5), (10.5, 20.5))


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (LOG, {"time": "t", "value": "F_N", "delimiter": ";", "decimal": ","}),
        (LOG, {"time": 1, "value": 3, "decimal": ","}),
        (LOG, {"value": "F_N", "decimal": ","}),
        (LOG.replace(";", "\t"), {"value": "F_N", "decimal": ",", "delimiter": "\t"}),
        (LOG.replace(";", "\t"), {"value": "F_N", "decimal": ","}),
        (LOG.replace(",", ".").replace(";", ","), {"time": "t", "value": "F_N"}),
        (LOG.replace(",", ".").replace(";", "  "), {"time": "t", "value": "F_N"}),
        (LOG.replace(",", ".").replace(";", "|"), {"value": 3, "delimiter": "|"}),
        ("\ufeff" + LOG, {"time": "t", "value": "F_N", "decimal": ","}),
        (LOG.replace("\n", "\r\n"), {"time": "t", "value": "F_N", "decimal": ","}),
        (LOG.removesuffix("\n"), {"value": 3, "decimal": ","}),
        # As a logger writes it: lines above the names, units below them, comments, empty lines.
        (
            f"Logger 7\nserial;123\n# made by hand; t;F_N\n{LOG}".replace(
                "F_N\n", "F_N\ns;1;N\n\n"
            ),
            {"time": "t", "value": "F_N", "decimal": ","},
        ),
        # Quotes are around cells with the delimiter or an end of line in them.
        (
            't,"remark, free","F_N"\n"0.0","a\n""b""",10.5\n0.5,"c, d",20.5\n',
            {"time": "t", "value": "F_N", "delimiter": ","},
        ),
        (" t ; F_N \n 0.0 ; 10.5 \n 0.5 ; 20.5 \n", {"time": "t", "value": " F_N"}),
        # The order of columns is that of the keys.
        ("F_N,t\n10.5,0.0\n20.5,0.5\n", {"time": "t", "value": "F_N"}),
        ("10.5,0.0\n20.5,0.5\n", {"time": 2, "value": 1}),
        # Two columns, told only what a comma is.
        ("0,0;10,5\n0,5;20,5\n", {"decimal": ","}),
        ("t;F\n-0,0;10,5\n0,5;20,5\n", {"decimal": ","}),
    ],
)
def test_columns_are_read_by_name_or_number(
    text: str, keys: dict[str, Any], tmp_path: Path
) -> None:
    signal = read(tmp_path, text, **keys)
    assert (signal.time, signal.value) == POINTS


def test_quoted_cells_may_span_lines(tmp_path: Path) -> None:
    text = 't,note,F\n0,"two\nlines",1\n1,x,y\n'
    keys = {"time": "t", "value": "F"}
    assert "csv: line 4 of 'log.csv': expected a finite number" in fault(tmp_path, text, **keys)


NAMED = {"time": "t", "value": "F_N"}


@pytest.mark.parametrize(
    ("text", "keys", "message"),
    [
        (
            "t,F_n\n0,1\n",
            NAMED,
            "value: line 1 of 'log.csv': unknown column 'F_N' (did you mean 'F_n'?)",
        ),
        (
            "log of today\nt,x,\n0,1\n",
            NAMED,
            "value: line 2 of 'log.csv': unknown column 'F_N'; known: t, x",
        ),
        (
            "0,1\n1,2\n",
            {"value": "F_N"},
            "value: 'log.csv' has no line with the names of its columns; give the number of 'F_N',"
            " from 1",
        ),
        (
            "t,F_N,F_N\n0,1,2\n",
            NAMED,
            "value: line 1 of 'log.csv': columns 2, 3 are all named 'F_N'; give the number of one"
            " of them",
        ),
        (
            "t,F_N\n0,1\n1,x\n",
            NAMED,
            "csv: line 3 of 'log.csv': expected a finite number in column 2 for value, got 'x'",
        ),
        (
            "t,F_N\n0,1\n,2\n",
            NAMED,
            "csv: line 3 of 'log.csv': expected a finite number in column 1 for time, got ''",
        ),
        (
            "0,1\n1,nan\n",
            {"value": 2},
            "csv: line 2 of 'log.csv': expected a finite number in column 2 for value, got 'nan'",
        ),
        (
            "0;1.5\n1;2_0\n",
            {"value": 2},
            "csv: line 2 of 'log.csv': expected a finite number in column 2 for value, got '2_0'",
        ),
        (
            "0;1,5\n",
            {"value": 2},
            "csv: line 1 of 'log.csv': expected a finite number in column 2 for value, got '1,5';"
            " if ',' is the decimal mark, give decimal = \",\"",
        ),
        (
            "0;1.234,5\n",
            {"decimal": ","},
            "csv: line 1 of 'log.csv': expected a finite number in column 2 for value, got"
            " '1.234,5'",
        ),
        (
            "0;1.5\n",
            {"decimal": ","},
            "csv: line 1 of 'log.csv': expected a finite number in column 2 for value, got '1.5';"
            " if '.' is the decimal mark, give decimal = \".\"",
        ),
        ("0,1\n", {"value": 3}, "csv: line 1 of 'log.csv': no column 3 for value, only 2"),
        ("t,F_N\n0,1\n0.5\n", NAMED, "csv: line 3 of 'log.csv': no column 2 for value, only 1"),
        (
            "0,1\n2,1\n\n1,1\n",
            {"value": 2},
            "csv: line 4 of 'log.csv': times must increase from line to line, but 1.0 s follows"
            " 2.0 s",
        ),
        (
            "0,1\n0,2\n",
            {},
            "csv: line 2 of 'log.csv': times must increase from line to line, but 0.0 s follows"
            " 0.0 s",
        ),
        (
            "0,1,2\n",
            {},
            "csv: line 1 of 'log.csv': expected a time and a value, both finite, got '0 1 2'; of"
            " several columns, choose with time and value",
        ),
        ("", NAMED, "csv: 'log.csv' has no lines with a time and a value"),
        ("t,F_N\n0,1832.6\n", NAMED, ONE_LINE),
        ("# force\n0.5 1832.6\n", {}, ONE_LINE),
        ("t,F_N\n", NAMED, "csv: 'log.csv' has no lines with a time and a value"),
        ("t,F_N\n", {"value": 2}, "csv: 'log.csv' has no lines with a time and a value"),
        ("0,1\n", {"time": 2}, "value: column 2 is that of the time, too"),
        ("t,F_N\n0,1\n", {"time": "F_N"}, "value: column 2 is that of the time, too"),
        (
            't,F_N\n0,"1\n1,2\n',
            NAMED,
            "csv: line 2 of 'log.csv', separated by ',': not valid CSV: unexpected end of data",
        ),
        (
            LOG,
            {"delimiter": ",", "decimal": ","},
            "delimiter: ',' is the decimal mark, too; give another delimiter, such as ';'",
        ),
        (
            LOG,
            {"delimiter": ";;"},
            "delimiter: expected one character between cells, such as ';' or '\\t', got ';;'",
        ),
        (
            LOG,
            {"delimiter": "x"},
            "delimiter: expected one character between cells, such as ';' or '\\t', got 'x'",
        ),
        (LOG, {"decimal": "'"}, "decimal: expected '.' or ',', got '''"),
        (
            LOG,
            {"value": 0},
            "value: expected the name of a column in quotes, or its number from 1, got 0",
        ),
        (
            LOG,
            {"value": True},
            "value: expected the name of a column in quotes, or its number from 1, got true",
        ),
        (
            LOG,
            {"time": " "},
            "time: expected the name of a column in quotes, or its number from 1, got ' '",
        ),
        (LOG, {"valeu": 2}, "valeu: unknown key 'valeu' (did you mean 'value'?)"),
        (LOG, {"speed": 2}, "speed: unknown key 'speed'; known: csv, time, value, delimiter,"),
        (b"\xff\xfe0", NAMED, "csv: cannot read 'log.csv' (it is not UTF-8 text); the path is"),
    ],
)
def test_what_a_file_lacks_is_reported(
    text: str | bytes, keys: dict[str, Any], message: str, tmp_path: Path
) -> None:
    assert fault(tmp_path, text, **keys).startswith(f"force.{message}")


def test_the_name_of_the_file_is_text() -> None:
    for name, found in ((3, "text in quotes, got 3"), ("", "text of at least one character, g")):
        with pytest.raises(ValidationError) as refused:
            Drive.model_validate({"force": {"csv": name}})
        ((path, message),) = [error_message(error, Drive) for error in refused.value.errors()]
        assert path == ("force", "csv")
        assert message.startswith(f"expected {found}")


def test_a_torque_over_speed_comes_from_columns(tmp_path: Path) -> None:
    (tmp_path / "motor.csv").write_text("w;M\n-10;5\n10;-5\n")

    def torque(**keys: Any) -> Any:
        table = {"torque": {"csv": "motor.csv", **keys}}
        return BeltDrive.model_validate(table, context={"folder": tmp_path}).torque

    over_speed = torque(speed="w", value="M")
    assert isinstance(over_speed, SpeedTable)
    assert (over_speed.speed, over_speed.value) == ((-10.0, 10.0), (5.0, -5.0))
    assert torque(speed=1) == over_speed
    assert isinstance(torque(time="w", value="M"), PiecewiseLinearTable)
    assert isinstance(torque(), PiecewiseLinearTable)
    faults = {}
    for keys in ({"speed": 1, "time": 1}, {"speed": 2, "value": 1}):
        with pytest.raises(ValidationError) as refused:
            torque(**keys)
        (error,) = refused.value.errors()
        faults[len(faults)] = error_message(error, BeltDrive)
    assert faults == {
        0: (("torque", "speed"), "expected a column of time or of speed; found both"),
        1: (
            ("torque", "csv"),
            f"line 3 of '{tmp_path}/motor.csv': speeds must increase from line to line, but -5.0"
            " rad/s follows 5.0 rad/s",
        ),
    }
