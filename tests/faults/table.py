"""The table of faults: what each means, the text that it replaces, and the tests nearest to it."""

import ast
import tomllib
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_name("faults.toml")


@dataclass(frozen=True)
class Fault:
    """An error that can be set into a file.

    Attributes
    ----------
    name, room, origin : str
        `origin` is "chosen", or "drawn" with the seed that repeats it.
    meaning : str
        What is wrong then, in words that outlive the code.
    file : str
        From the root of the sources.
    old, new : str
        The text that is replaced, which the file has exactly once, and what stands there instead.
    nearest : tuple of str
        The tests that should find it, the most specific first, as pytest takes them.
    """

    name: str
    room: str
    origin: str
    meaning: str
    file: str
    old: str
    new: str
    nearest: tuple[str, ...]

    @property
    def digest(self) -> str:
        """What the outcome of tests depends on, in short."""
        text = "\0".join((self.file, self.old, self.new, *self.nearest))
        return sha256(text.encode()).hexdigest()[:8]

    def set_in(self, root: Path) -> None:
        """Write the file with the fault.

        Raises
        ------
        ValueError
            If it cannot be set; the message says why.
        """
        path = root / self.file
        path.write_text(self.faulty(path), encoding="utf-8")

    def faulty(self, path: Path) -> str:
        """Return the text of the file with the fault; raises as `set_in`."""
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if (count := text.count(self.old)) != 1 or self.old == self.new:
            raise ValueError(
                f"{TABLE.name}: {self.name}: expected the old text exactly once in {self.file},"
                f" and another new text; found it {count} times: set the fault that is described"
                f" where the code now stands: {self.meaning}"
            )
        return text.replace(self.old, self.new)

    def check(self, root: Path = ROOT) -> None:
        """Check that the fault can be set, that Python reads it, and that its tests are there.

        Raises
        ------
        ValueError
        """
        faulty = self.faulty(root / self.file)
        if self.file.endswith(".py"):
            try:
                ast.parse(faulty)
            except SyntaxError as error:
                raise ValueError(f"{TABLE.name}: {self.name}: the new text is no Python") from error
        absent = [path for path in self.nearest if not (root / path.split("::")[0]).exists()]
        if absent or not self.nearest:
            raise ValueError(f"{TABLE.name}: {self.name}: nearest: no such tests: {absent}")


@cache
def faults() -> tuple[Fault, ...]:
    """Return all faults of the table."""
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["fault"]
    return tuple(Fault(**{**row, "nearest": tuple(row["nearest"])}) for row in rows)


def mistakes() -> list[str]:
    """Return what is wrong with the table."""
    found = []
    names = [fault.name for fault in faults()]
    found += [f"{TABLE.name}: {n}: the name stands twice" for n in set(names) if names.count(n) > 1]
    for fault in faults():
        try:
            fault.check()
        except ValueError as error:
            found.append(str(error))
    return found
