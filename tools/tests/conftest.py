"""Makes the package and the synthetic run available to the tests."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parent)]

from browser import MISSING, Browser  # noqa: E402
from micstools.reading.reader import Run  # noqa: E402
from synthetic import write_run  # noqa: E402


@pytest.fixture(scope="session")
def loose_pile(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A synthetic run that ends in six blocks above the fixed ones."""
    return Run(write_run(tmp_path_factory.mktemp("loose") / "run"))


@pytest.fixture
def make_run(tmp_path: Path):
    """Writes a synthetic run with the given motion and opens it."""
    return lambda motion: Run(write_run(tmp_path / "run", motion))


@pytest.fixture(scope="session")
def one_browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser for all tests."""
    if MISSING:
        pytest.skip(MISSING)
    with Browser(tmp_path_factory.mktemp("browser")) as found:
        yield found


@pytest.fixture
def browser(one_browser: Browser) -> Iterator[Browser]:
    """A browser in which nothing may fail."""
    yield one_browser
    assert one_browser.errors == []
