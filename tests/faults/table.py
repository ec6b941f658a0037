"""The table of faults: what each means, and the text that it replaces."""

import ast
import tomllib
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_name("faults.toml")
# The rooms of each group; all others are "elsewhere".
GROUPS = {"belts": ("belts",), "mechanisms": ("mechanisms", "solvers"), "elsewhere": ()}


@dataclass(frozen=True)
class Fault:
    """An error that can be set into a file.

    Attributes
    ----------
    name, room, origin : str
        `origin` is "chosen", or "drawn" with its seed.
    meaning : str
        What is wrong then, in words that outlive the code.
    file, old, new : str
        The text that is replaced, which the file has exactly once, and what stands there instead.
    """

    name: str
    room: str
    origin: str
    meaning: str
    file: str
    old: str
    new: str

    @property
    def digest(self) -> str:
        """Digest of what is set."""
        return sha256("\0".join((self.file, self.old, self.new)).encode()).hexdigest()[:8]

    @property
    def group(self) -> str:
        """The third of the table that it belongs to."""
        return next((name for name, rooms in GROUPS.items() if self.room in rooms), "elsewhere")

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


def in_turns() -> list[Fault]:
    """Return the faults so that each part of the list has as much of each group as the whole."""
    places = {}
    for group in GROUPS:
        own = sorted((f for f in faults() if f.group == group), key=lambda f: f.digest)
        places |= {fault.name: place / len(own) for place, fault in enumerate(own)}
    return sorted(faults(), key=lambda fault: places[fault.name])


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
