"""Faults drawn at random from the syntax trees of the package.

A module is drawn by its lines of code, then a sort of change, and one of this sort. Drawn faults
show what the tests find among errors that nobody has thought of.
"""

import ast
import io
import json
import random
import tokenize
from collections.abc import Iterator
from pathlib import Path

from tests.faults.table import ROOT, Fault

Change = tuple[str, int, int, str]  # what it is; from and to where, and what stands there then

OPERATORS = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.Pow: ("**", "*"), ast.FloorDiv: ("//", "/"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"),
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "sin": "cos", "cos": "sin"}
NAMES |= {"minimum": "maximum", "maximum": "minimum", "floor": "ceil", "ceil": "floor"}
NO_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}


class Changes(ast.NodeVisitor):
    """Collects the changes of one source; annotations and texts are left as they are."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.starts = [0]
        for line in text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.found: list[Change] = []
        self.visit(ast.parse(text))

    def at(self, node: ast.AST, end: bool = False) -> int:
        """Return where a node begins or ends in the text."""
        line, column = ("end_lineno", "end_col_offset") if end else ("lineno", "col_offset")
        start = self.starts[getattr(node, line) - 1]
        row = self.text[start : start + 400].split("\n")[0].encode()
        return start + len(row[: getattr(node, column)].decode())

    def source(self, node: ast.AST) -> str:
        """Return the text of a node."""
        return self.text[self.at(node) : self.at(node, end=True)]

    def replace(self, what: str, node: ast.AST, new: str) -> None:
        """Offer another text for a node."""
        self.found.append((what, self.at(node), self.at(node, end=True), new))

    def swap_operator(self, what: str, *nodes: ast.AST) -> None:
        """Offer another operator between two nodes."""
        left, operator, right = nodes
        if type(operator) not in OPERATORS:
            return
        old, new = OPERATORS[type(operator)]
        begin, end = self.at(left, end=True), self.at(right)
        between = self.text[begin:end]
        if "#" not in between and between.count(old) == 1:
            self.found.append((what, begin, end, between.replace(old, new)))

    def visit_BinOp(self, node: ast.BinOp) -> None:
        """Offer another sign or a division in place of a product."""
        self.swap_operator("sign", node.left, node.op, node.right)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        """Offer `or` in place of `and`."""
        for left, right in zip(node.values, node.values[1:], strict=False):
            self.swap_operator("logic", left, node.op, right)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        """Offer a limit that belongs to the other side, or the opposite."""
        for left, operator, right in zip(
            [node.left, *node.comparators], node.ops, node.comparators, strict=False
        ):
            self.swap_operator("limit", left, operator, right)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        """Offer no sign, or no `not`."""
        self.replace("sign", node, self.source(node.operand))
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        """Offer another factor, number or truth."""
        if isinstance(node.value, bool):
            self.replace("logic", node, str(not node.value))
        elif isinstance(node.value, int):
            self.replace("number", node, str(node.value + 1))
        elif isinstance(node.value, float):
            self.replace("number", node, f"{2 * node.value or 1.0!r}")

    def visit_Name(self, node: ast.Name) -> None:
        """Offer `max` in place of `min`, and the like."""
        if node.id in NAMES:
            self.replace("extreme", node, NAMES[node.id])

    def visit_Attribute(self, node: ast.Attribute) -> None:
        """Offer the same for what an object or a module has."""
        if node.attr in NAMES:
            self.replace("extreme", node, f"{self.source(node.value)}.{NAMES[node.attr]}")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        """Offer the first two arguments swapped, or the last keyword dropped."""
        first, second, *_ = [*node.args, node, node]
        if {type(first), type(second)} <= {ast.Name, ast.Attribute, ast.BinOp}:
            gap = self.text[self.at(first, end=True) : self.at(second)]
            new = self.source(second) + gap + self.source(first)
            self.found.append(("arguments", self.at(first), self.at(second, end=True), new))
        if node.keywords and (node.args or len(node.keywords) > 1):
            before = (node.args + [keyword.value for keyword in node.keywords])[-2]
            end = self.at(node.keywords[-1], end=True)
            self.found.append(("arguments", self.at(before, end=True), end, ""))
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        """Offer the other branch; what only types need is no code."""
        if "TYPE_CHECKING" not in self.source(node.test):
            self.replace("logic", node.test, f"not ({self.source(node.test)})")
            self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        """Offer the other value."""
        self.replace("logic", node.test, f"(not ({self.source(node.test)}))")
        self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        """Offer no call; a docstring is no code."""
        if not isinstance(node.value, ast.Constant):
            self.replace("statement", node, "pass")
            self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        """Offer a sum that is not added to."""
        self.replace("statement", node, "pass")
        self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        """Offer no error."""
        self.replace("statement", node, "pass")
        self.generic_visit(node)

    def visit_Continue(self, node: ast.Continue) -> None:
        """Offer the end of the loop."""
        self.replace("statement", node, "break")

    def visit_Break(self, node: ast.Break) -> None:
        """Offer one more turn of the loop."""
        self.replace("statement", node, "continue")

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        """Go into the value only."""
        if node.value is not None:
            self.visit(node.value)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        """Go into the defaults and the body only."""
        for part in [*node.args.defaults, *filter(None, node.args.kw_defaults), *node.body]:
            self.visit(part)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Leave it: Python 3.11 does not know where its parts are."""


def lines_of_code(text: str) -> int:
    """Return the lines that are neither blank, comment nor docstring."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    used = {t.start[0] for t in tokens if t.type not in NO_CODE and t.line.strip() != t.string}
    return len(used)


def _sources() -> Iterator[tuple[Path, int]]:
    for path in sorted((ROOT / "frictionsim").rglob("*.py")):
        yield path, lines_of_code(path.read_text())


def draw(seed: int) -> Fault:
    """Return the fault of a seed; its meaning and its tests are for a person to write."""
    generator = random.Random(seed)
    paths, weights = zip(*_sources(), strict=True)
    path, text = ROOT, ""
    changes: list[Change] = []
    while not changes:
        path = generator.choices(paths, weights)[0]
        text = path.read_text()
        changes = Changes(text).found
    # Numbers and conditions are many, and would be most of what is drawn.
    drawn = generator.choice(sorted({what for what, *_ in changes}))
    _, begin, end, new = generator.choice([change for change in changes if change[0] == drawn])
    # Whole lines, and as many before them as make the text the only one.
    first, last = text.rfind("\n", 0, begin) + 1, text.find("\n", end)
    while text.count(text[first:last]) > 1:
        first = text.rfind("\n", 0, first - 1) + 1
    room = path.relative_to(ROOT / "frictionsim").parts[0].removesuffix(".py")
    old, changed = text[first:last], text[first:begin] + new + text[end:last]
    return Fault("", room, f"drawn, seed {seed}", "", str(path.relative_to(ROOT)), old, changed, ())


def as_toml(fault: Fault) -> str:
    """Return a fault as it stands in the table."""
    keys = ("name", "room", "origin", "meaning", "file")
    lines = [f"{key} = {json.dumps(getattr(fault, key))}" for key in keys]
    for key in ("old", "new"):
        text = getattr(fault, key)
        lines.append(f"{key} = '''\n{text}'''" if "\n" in text else f"{key} = '''{text}'''")
    return "\n".join(["[[fault]]", *lines, f"nearest = {json.dumps(fault.nearest)}"])
