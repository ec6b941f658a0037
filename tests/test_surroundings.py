"""The default tests pass in other places, for other users, on other processors and versions."""

import sys

import pytest

from tests.surroundings import ALL, run


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="users and shells of POSIX")
@pytest.mark.parametrize("name", ALL)
def test_the_default_tests_pass(name: str) -> None:
    assert run(name, []) == 0
