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
from itertools import pairwise
from pathlib import Path

from tests.faults.table import GROUPS, ROOT, Fault

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


class _Source:
    """A text and the changes that its syntax tree offers; types and words stay."""

    def __init__(self, text: str) -> None:
        self.text, self.lines = text, text.splitlines(keepends=True)
        self.changes = list(self._changes_in(ast.parse(text)))

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        """Return where a node begins and ends; a tree counts bytes."""
        places = ((node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0))
        before = [
            len("".join(self.lines[: n - 1])) + len(self.lines[n - 1].encode()[:column].decode())
            for n, column in places
        ]
        return before[0], before[1]

    def _of(self, node: ast.expr | ast.stmt) -> str:
        return self.text[slice(*self._span(node))]

    def _another(self, what: str, left: ast.expr, op: ast.AST, right: ast.expr) -> Iterator[Change]:
        """Yield the opposite of the operator between two operands."""
        old, new = OPERATORS.get(type(op), ("", ""))
        begin, end = self._span(left)[1], self._span(right)[0]
        between = self.text[begin:end]
        if old and "#" not in between and between.count(old) == 1:
            yield what, begin, end, between.replace(old, new)

    def _changes_in(self, node: ast.AST) -> Iterator[Change]:
        """Yield the changes of a node, then those of its children."""
        within: list[ast.AST] = list(ast.iter_child_nodes(node))
        match node:
            case ast.JoinedStr():  # Python 3.11 does not know where its parts are
                return
            case ast.If(test=test) if "TYPE_CHECKING" in self._of(test):
                return
            case ast.Expr(value=ast.Constant()):  # a docstring
                return
            case ast.AnnAssign(value=value):
                within = [value] if value else []
            case ast.FunctionDef(args=args, body=body):
                within = [*args.defaults, *filter(None, args.kw_defaults), *body]
            case ast.BinOp(left=left, op=op, right=right):
                yield from self._another("sign", left, op, right)
            case ast.BoolOp(op=op, values=values):
                for left, right in pairwise(values):
                    yield from self._another("logic", left, op, right)
            case ast.Compare(left=left, ops=relations, comparators=rest):
                for pair, relation in zip(pairwise([left, *rest]), relations, strict=True):
                    yield from self._another("limit", pair[0], relation, pair[1])
            case ast.UnaryOp(operand=operand):
                yield "sign", *self._span(node), self._of(operand)
            case ast.Constant(value=bool() as value):
                yield "logic", *self._span(node), str(not value)
            case ast.Constant(value=int() as value):
                yield "number", *self._span(node), str(value + 1)
            case ast.Constant(value=float() as value):
                yield "number", *self._span(node), f"{2 * value or 1.0!r}"
            case ast.Name(id=name) if name in NAMES:
                yield "extreme", *self._span(node), NAMES[name]
            case ast.Attribute(attr=name, value=value) if name in NAMES:
                yield "extreme", *self._span(node), f"{self._of(value)}.{NAMES[name]}"
            case ast.Call():
                yield from self._other_arguments(node)
            case ast.If(test=test):
                yield "logic", *self._span(test), f"not ({self._of(test)})"
            case ast.IfExp(test=test):
                yield "logic", *self._span(test), f"(not ({self._of(test)}))"
            case ast.Expr() | ast.AugAssign() | ast.Raise():
                yield "statement", *self._span(node), "pass"
            case ast.Continue() | ast.Break():
                other = "break" if isinstance(node, ast.Continue) else "continue"
                yield "statement", *self._span(node), other
        for part in within:
            yield from self._changes_in(part)

    def _other_arguments(self, call: ast.Call) -> Iterator[Change]:
        """Yield a call with its first arguments swapped, and without the last keyword."""
        first, second, *_ = [*call.args, call, call]
        if {type(first), type(second)} <= {ast.Name, ast.Attribute, ast.BinOp}:
            (begin, gap), (resumed, end) = self._span(first), self._span(second)
            swapped = self._of(second) + self.text[gap:resumed] + self._of(first)
            yield "arguments", begin, end, swapped
        if call.keywords and (call.args or len(call.keywords) > 1):
            *_, before, last = [*call.args, *(keyword.value for keyword in call.keywords)]
            yield "arguments", self._span(before)[1], self._span(last)[1], ""


def lines_of_code(text: str) -> int:
    """Return the lines that are neither blank, comment nor docstring."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return len({t.start[0] for t in tokens if t.type not in NO_CODE and t.line.strip() != t.string})


def _room(path: Path) -> str:
    parts = path.relative_to(ROOT / "frictionsim").parts
    return "belts" if "belt_drive" in parts else parts[0].removesuffix(".py")


def draw(seed: int, group: str) -> Fault:
    """Return the fault of a seed in a group of rooms; its meaning is for a person to write."""
    generator = random.Random(seed)
    others = [room for rooms in GROUPS.values() for room in rooms]
    texts = {
        path: path.read_text(encoding="utf-8")
        for path in sorted((ROOT / "frictionsim").rglob("*.py"))
        if (_room(path) in GROUPS[group] if GROUPS[group] else _room(path) not in others)
    }
    weights = [lines_of_code(text) for text in texts.values()]
    changes: list[Change] = []
    while not changes:
        path = generator.choices(list(texts), weights)[0]
        changes = _Source(texts[path]).changes
    # Numbers and conditions are many, and would be most of what is drawn.
    drawn = generator.choice(sorted({what for what, *_ in changes}))
    _, begin, end, new = generator.choice([change for change in changes if change[0] == drawn])
    # Whole lines, and as many before them as make the text the only one.
    text = texts[path]
    first, last = text.rfind("\n", 0, begin) + 1, text.find("\n", end)
    while text.count(text[first:last]) > 1:
        first = text.rfind("\n", 0, first - 1) + 1
    old, changed = text[first:last], text[first:begin] + new + text[end:last]
    origin, name = f"drawn from {group}, seed {seed}", str(path.relative_to(ROOT))
    return Fault("", _room(path), origin, "", name, old, changed)


def as_toml(fault: Fault) -> str:
    """Return a fault as it stands in the table."""
    keys = ("name", "room", "origin", "meaning", "file")
    lines = [f"{key} = {json.dumps(getattr(fault, key))}" for key in keys]
    for key in ("old", "new"):
        text = getattr(fault, key)
        first = "\n" if "\n" in text else ""  # TOML leaves the first line break out
        lines.append(f"{key} = '''{first}{text}'''")
    return "\n".join(["[[fault]]", *lines])
