"""The tables of a signal from a CSV file: `{csv = "log.csv", time = "t", value = "F_N", ...}`.

With `csv` alone the file has two columns, separated by comma, semicolon, space or tab. Any further
key makes it a table of columns, which Python's `csv` reads, with quotes around cells or without.
"""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, PlainValidator, model_validator
from pydantic_core import PydanticCustomError

from frictionsim.scenario.schema import Params, inconsistent

NO_DELIMITERS = "\"'#+-.\r\n"  # signs of a number, of a comment, of a quotation


def _column(value: Any) -> str | int:
    if isinstance(value, str) and value.strip():
        return value.strip()
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise PydanticCustomError("column", "expected a column")  # worded in messages.py


def _delimiter(value: Any) -> str:
    one = isinstance(value, str) and len(value) == 1
    if one and not value.isalnum() and value not in NO_DELIMITERS:
        return str(value)
    raise PydanticCustomError("delimiter", "expected a delimiter")  # worded in messages.py


Column = Annotated[
    str | int,
    PlainValidator(
        _column,
        json_schema_input_type=Annotated[str, Field(pattern=r"\S")] | Annotated[int, Field(ge=1)],
    ),
]
Delimiter = Annotated[
    str,
    PlainValidator(
        _delimiter,
        json_schema_input_type=Annotated[str, Field(pattern=r"^[^0-9A-Za-z\"'#+.\r\n-]$")],
    ),
]


class CsvTable(Params):
    """`{csv = "log.csv", time = "t", value = "F_N"}`: points from columns of a file."""

    csv: str = Field(
        min_length=1, description="File, relative to the scenario; # begins a comment in it."
    )
    time: Column | None = Field(
        None, description="Column of the times, s, by name or number; the first if left out."
    )
    value: Column | None = Field(
        None, description="Column of the values, by name or number; the second if left out."
    )
    delimiter: Delimiter | None = Field(
        None, description="Character between cells; if left out `;`, tab, `,` or space, as found."
    )
    decimal: Literal[".", ","] = Field(".", description="Decimal mark of the numbers.")

    @property
    def has_columns(self) -> bool:
        """Whether any key says more about the file than its name."""
        return bool(self.model_fields_set - {"csv"})

    @property
    def abscissa(self) -> Literal["time", "speed"]:
        """What the values are given over."""
        return "time"

    @model_validator(mode="after")
    def _delimiter_is_not_the_decimal_mark(self) -> Self:
        if self.delimiter == self.decimal:
            raise inconsistent(
                ("delimiter",),
                f"'{self.delimiter}' is the decimal mark, too; give another delimiter, such as ';'",
            )
        return self


class CsvSpeedTable(CsvTable):
    """`{csv = "log.csv", speed = "w", value = "M_Nm"}`: points from columns, over a speed."""

    speed: Column | None = Field(
        None, description="Column of speeds, rad/s, by name or number, in the place of time."
    )

    @property
    def abscissa(self) -> Literal["time", "speed"]:
        return "time" if self.speed is None else "speed"

    @model_validator(mode="after")
    def _over_time_or_speed(self) -> Self:
        if self.speed is not None and self.time is not None:
            raise inconsistent(("speed",), "expected a column of time or of speed; found both")
        return self
