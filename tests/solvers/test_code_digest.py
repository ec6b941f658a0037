"""The digest of code of plug-ins: another one for whatever compiled code takes from anywhere."""

import importlib
import py_compile
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from frictionsim.solvers.code_digest import code_digest
from tests.support.scenarios import ROOT

EQUATION = """
from typing import NamedTuple
{imports}


class Factor(NamedTuple):
    factor: float

    def times(self, x):
        return {product}


def product(factor: Factor, x: float) -> float:
    return factor.times(x)
"""
LAW = "def law(x):\n    return {v} * x\n"
# How the equation takes a number or a function v from another file.
WAYS = {
    "a function": ("from other import law", "law(self.factor * x)", {"other.py": LAW}),
    "a function of a module": ("import other", "other.law(x)", {"other.py": LAW}),
    "a function within a package": (
        *("import pack.laws", "pack.laws.law(x)"),
        {"pack/__init__.py": "", "pack/laws.py": LAW},
    ),
    "a function that a package passes on": (
        *("import pack", "pack.law(x)"),
        {"pack/__init__.py": "from pack.laws import law", "pack/laws.py": LAW},
    ),
    "a function that a function calls": (
        *("from other import law", "law(x)"),
        {"other.py": "import third\ndef law(x):\n    return third.law(x)", "third.py": LAW},
    ),
    "a function of numba": (
        *("from other import law", "law(x)"),
        {"other.py": f"import numba\n@numba.njit\n{LAW}"},
    ),
    "a closure": (
        *("from other import law", "law(x)"),
        {"other.py": "def of(k):\n    return lambda x: k * x\nlaw = of({v})"},
    ),
    "a number": ("from other import K", "K * x", {"other.py": "K = {v}"}),
    "a number of numpy": (
        *("from other import K", "K * x"),
        {"other.py": "import numpy as np\nK = np.sqrt(4.0) * {v}"},
    ),
    "an array in a tuple": (
        *("from other import K", "K[0][0] * x"),
        {"other.py": "import numpy as np\nK = (np.array([{v}]), 1.0)"},
    ),
    "a named tuple": (
        *("from other import K", "K.k * x"),
        {"other.py": "from collections import namedtuple\nK = namedtuple('K', 'k')({v})"},
    ),
    "a member of an enumeration": (
        *("from other import E", "E.A * x"),
        {"other.py": "from enum import IntEnum\nclass E(IntEnum):\n    A = int({v})"},
    ),
    "a number deep in a package": (
        *("import pack.a.b", "pack.a.b.K * x"),
        {"pack/__init__.py": "", "pack/a/__init__.py": "", "pack/a/b.py": "K = {v}"},
    ),
    "a number of a file": (
        *(
            "from pathlib import Path\nK = float((Path(__file__).parent / 'k').read_text())",
            "K * x",
        ),
        {"k": "{v}"},
    ),
}
Digest = Callable[[], str]


@pytest.fixture
def digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Digest:
    """Return a function for the digest of the equation in the folder as it is now."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def digest_now() -> str:
        for name in ("equation", "other", "third", "pack", "pack.laws", "pack.a", "pack.a.b"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        module = importlib.import_module("equation")
        return code_digest([module.Factor, module.product], {})

    return digest_now


@pytest.mark.parametrize("way", WAYS)
def test_another_number_is_another_digest(way: str, tmp_path: Path, digest: Digest) -> None:
    imports, product, files = WAYS[way]
    (tmp_path / "equation.py").write_text(EQUATION.format(imports=imports, product=product))
    digests = []
    for value in ("1.0", "1.0", "3.0"):
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text.replace("{v}", value))
        digests.append(digest())
    assert digests[0] == digests[1] != digests[2]


METHOD = "def times(self, x):\n    return {v} * x\n"
BASE = f"from typing import NamedTuple\nclass Base(NamedTuple):\n    k: float\n    {METHOD}"


@pytest.mark.parametrize(
    ("factor", "other"),
    [
        ("class Factor(Base):\n    pass", BASE.replace("\n    return", "\n        return")),
        ("class Factor(NamedTuple):\n    k: float\n    times = times", METHOD),
        ("class Factor(NamedTuple):\n    k: float\n    K = K", "K = {v}"),
    ],
    ids=["of a base class", "from another module", "constant"],
)
def test_members_of_classes_count(factor: str, other: str, tmp_path: Path, digest: Digest) -> None:
    head = "from typing import NamedTuple\nfrom other import *\n"
    (tmp_path / "equation.py").write_text(
        f"{head}{factor}\ndef product(f, x):\n    return f.times(x)"
    )
    digests = []
    for value in ("1.0", "1.0", "3.0"):
        (tmp_path / "other.py").write_text(other.replace("{v}", value))
        digests.append(digest())
    assert digests[0] == digests[1] != digests[2]


def test_what_is_in_memory_counts_not_the_source(tmp_path: Path, digest: Digest) -> None:
    """Which may have been edited since, or be missing."""
    source, compiled = tmp_path / "equation.py", tmp_path / "equation.pyc"
    source.write_text(EQUATION.format(imports="", product="1.0 * x"))
    before = digest()
    module = sys.modules["equation"]
    py_compile.compile(str(source), cfile=str(compiled), doraise=True)
    source.write_text(EQUATION.format(imports="", product="3.0 * x"))
    assert code_digest([module.Factor, module.product], {}) == before
    assert digest() != before
    source.unlink()
    assert digest() == before


def test_a_function_that_calls_itself_has_a_digest(tmp_path: Path, digest: Digest) -> None:
    (tmp_path / "equation.py").write_text(EQUATION.format(imports="", product="product(self, x)"))
    assert digest() == digest()


def test_what_is_compiled_in_the_place_of_a_function_counts(tmp_path: Path, digest: Digest) -> None:
    (tmp_path / "equation.py").write_text(EQUATION.format(imports="", product="x"))
    before, product = digest(), sys.modules["equation"].product
    digests = {code_digest([product], {product: choice}) for choice in (float, abs)}
    assert len(digests | {before, code_digest([product], {})}) == 4


def test_an_equation_has_one_digest_whatever_the_process_hashes(tmp_path: Path) -> None:
    imports = "import numpy as np\nfrom math import sin\nK = frozenset(('a', 'b', 'c')), {1.5, 2.5}"
    product = "sin(x) * np.cos(x) if 'a' in {'a', 'b', 'c'} else product(K, self)"
    (tmp_path / "equation.py").write_text(EQUATION.format(imports=imports, product=product))
    program = (
        "from equation import Factor, product;"
        " from frictionsim.solvers.code_digest import code_digest;"
        " print(code_digest([Factor, product], {}))"
    )
    said = {
        subprocess.run(
            [sys.executable, "-c", program],
            cwd=tmp_path,
            env={"PYTHONPATH": f"{tmp_path}:{ROOT}", "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")  # the first without, the others with compiled sources
    }
    assert len(said) == 1
