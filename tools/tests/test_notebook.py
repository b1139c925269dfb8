"""The notebook among the tutorials runs from its first cell to its last, and is kept without
output."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))


@pytest.mark.cost(15)
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    if not os.access(ROOT / "mics", os.X_OK):
        pytest.skip("./mics is not built")
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "tools"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, timeout=300, resources=resources).execute()
    shown = [" ".join(str(out.get("data", out.get("text"))) for out in c.outputs) for c in cells]
    assert "image/png" in " ".join(shown) and "Dataset" not in shown[0]
    assert "<table" in shown[0] and "Coulomb" in shown[1] and "time of the run" not in shown[0]
    assert "heading_deg" in shown[3] and "10 runs" in " ".join(shown)
    assert f"](docs/tutorials/{path.name})" in (ROOT / "README.md").read_text()
