"""The table of faults: what each means, and the text that it replaces."""

import ast
import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_name("faults.toml")


class Fault(NamedTuple):
    """An error that can be set into a file."""

    name: str
    room: str  # that it is in
    origin: str  # "chosen", or "drawn" with its seed
    meaning: str  # what is wrong then, in words that outlive the code
    file: str
    old: str  # the text that is replaced, which the file has exactly once
    new: str

    def faulty(self, root: Path = ROOT) -> str:
        """Return the text of the file with the fault; a ValueError says why it cannot be set."""
        path, where = root / self.file, f"{TABLE.name}: {self.name}"
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if (count := text.count(self.old)) != 1 or self.old == self.new:
            raise ValueError(
                f"{where}: expected the old text exactly once in {self.file}, and another new text;"
                f" found it {count} times; set what is described in the code of now: {self.meaning}"
            )
        faulty = text.replace(self.old, self.new)
        if path.suffix == ".py":
            try:
                ast.parse(faulty)
            except SyntaxError as error:
                raise ValueError(f"{where}: the new text is no Python: {error}") from None
        return faulty


@cache
def faults() -> tuple[Fault, ...]:
    """Return all faults of the table."""
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["fault"]
    return tuple(Fault(**row) for row in rows)


def mistakes() -> list[str]:
    """Return the errors in the table."""
    messages = []
    if len({fault.name for fault in faults()}) < len(faults()):
        messages.append(f"{TABLE.name}: a name stands twice")
    for fault in faults():
        try:
            fault.faulty()
        except ValueError as error:
            messages.append(str(error))
    return messages
