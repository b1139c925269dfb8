"""The list of `make mutate` fits the sources."""

import pytest

from mutate import Mutation, mismatch, mutations


@pytest.mark.parametrize("mutation", mutations(), ids=lambda mutation: mutation.name)
def test_pattern(mutation: Mutation) -> None:
    assert mismatch(mutation) == ""
