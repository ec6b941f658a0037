"""Options of a function and its command: one model, whose errors name the argument or option.

Lists and mappings may be given as the texts of the command line: ``"A,B"`` for names or numbers,
``["NAME=VALUE"]`` for values by name.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, model_validator

from frictionsim.errors import ArgumentError
from frictionsim.scenario.arguments import plain_number, text_of
from frictionsim.scenario.schema import Params
from frictionsim.scenario.validation import ValidationFailure, key_text, validate_model


class Options(Params):
    """Options of a function; `of` makes them."""

    @model_validator(mode="before")
    @classmethod
    def _numbers_of_python(cls, data: Any) -> Any:
        """Take numbers of NumPy as numbers of Python, and whole floats as whole numbers."""
        return {name: plain_number(value) for name, value in data.items()}

    @classmethod
    def among(cls, arguments: Mapping[str, Any], **others: Any) -> Self:
        """Return the options among the arguments of a function, its `locals()`, as `of`."""
        named = {name: arguments[name] for name in cls.model_fields if name in arguments}
        return cls.of(**named | others)

    @classmethod
    def of(cls, **given: Any) -> Self:
        """Return the options; those that are None have their defaults.

        Raises
        ------
        ArgumentError
            If one is not valid.
        """
        try:
            return validate_model(
                cls, {name: value for name, value in given.items() if value is not None}
            )
        except ValidationFailure as failure:
            (argument, *inner), message = failure.faults[0]
            where = f"{key_text(tuple(inner))}: " if inner else ""
            raise ArgumentError(str(argument), f"{where}{message}") from None


def as_list(given: Any) -> list[Any]:
    """Return the values of a list, of a text with commas, or of a single value."""
    if isinstance(given, str):
        return [part.strip() for part in given.split(",")]
    return list(given) if isinstance(given, Iterable) else [given]


def as_names(given: Any) -> tuple[str, ...]:
    """Return names of a list or of a text with commas; raise ValueError if one is no text."""
    names = as_list(given)
    for name in names:
        if not isinstance(name, str):
            raise ValueError(f"expected names, got {text_of(name)}")
    return tuple(names)


Names = Annotated[tuple[str, ...], BeforeValidator(as_names)]


def function_of(arguments: str, *, switch: bool = False) -> BeforeValidator:
    """Return the check that a value is a function, or with `switch` true or false.

    `arguments` are those of the function, for the message.
    """

    def checked(value: Any) -> Any:
        if callable(value) or value is None or (switch and isinstance(value, bool)):
            return value
        wanted = f"{'True, False or ' * switch}a function of {arguments}"
        raise ValueError(f"expected {wanted}, got {value!r}")

    return BeforeValidator(checked)


def by_name(form: str, read: Callable[[str], Any]) -> Callable[[Any], Any]:
    """Return the reader of values by name, of a mapping or of texts NAME=VALUE.

    Parameters
    ----------
    form : str
        What a text looks like, for messages.
    read : callable
        Of the text of a value.
    """

    def values(given: Any) -> Any:
        if isinstance(given, Mapping):
            return dict(given)
        if isinstance(given, str) or not isinstance(given, Iterable):
            raise ValueError(f"expected a mapping, or texts {form}, got {text_of(given)}")
        pairs = [_pair(text, form, read) for text in given]
        names = [name for name, _ in pairs]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name} is given twice; leave one out")
        return dict(pairs)

    return values


def _pair(text: Any, form: str, read: Callable[[str], Any]) -> tuple[str, Any]:
    name, equals, value = (part.strip() for part in str(text).partition("="))
    if not (isinstance(text, str) and name and equals and value):
        raise ValueError(f"expected {form}, got {text_of(text)}")
    return name, read(value)


def number_or_name(text: str) -> float | str:
    """Return a number, or else the name of a column."""
    try:
        return float(text)
    except ValueError:
        return text


def column_of(text: str) -> str | int:
    """Return a column: digits are its number, anything else its name."""
    return int(text) if text.isdecimal() else text


def columns_of(given: Any) -> dict[str, str | int]:
    """Return the column of each name; the default is the name itself."""
    if isinstance(given, Mapping):
        for name, column in given.items():
            if not isinstance(column, str | int) or isinstance(column, bool):
                raise ValueError(f"{name}: expected a column, got {column!r}")
        return dict(given)
    names = [given] if isinstance(given, str) else as_names(given)
    pairs = (name.partition("=") for name in names)
    return {
        name.strip(): column_of(column.strip()) if equals else name.strip()
        for name, equals, column in pairs
    }


ColumnsOption = Annotated[dict[str, str | int], BeforeValidator(columns_of)]
"""Names that are those of their columns, too; or the column of each name."""
