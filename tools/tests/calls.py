"""Commands as a user gives them."""

from collections.abc import Sequence

import pytest

from micstools import cli


def mics_tools(words: Sequence[str]) -> int:
    """The exit code of `mics-tools` with these words."""
    with pytest.raises(SystemExit) as end:
        cli.main(list(words))
    return int(end.value.code or 0)
