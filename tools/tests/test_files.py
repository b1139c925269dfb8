"""Files are written whole or not at all, and stay what they were."""

import csv
import os
from pathlib import Path

import pytest

from micstools import files
from micstools.pages import html


def test_links_modes_and_neighbours_stay(tmp_path: Path) -> None:
    case, link, other = tmp_path / "case.nml", tmp_path / "link.nml", tmp_path / "case.nml.new"
    case.write_text("old")
    case.chmod(0o640)
    other.write_text("somebody's")
    link.symlink_to("case.nml")
    files.write(link, "new ü")
    assert link.readlink() == Path("case.nml") and case.read_text("utf-8") == "new ü"
    assert case.stat().st_mode & 0o777 == 0o640 and other.read_text() == "somebody's"
    (tmp_path / "again").hardlink_to(case)
    files.write(case, "newer")
    assert (tmp_path / "again").read_text() == "newer"
    files.write(tmp_path / "made", "text")
    assert {path.name for path in tmp_path.iterdir()} == {
        "again", "case.nml", "case.nml.new", "link.nml", "made",
    }  # fmt: skip


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_the_owner_stays(tmp_path: Path) -> None:
    path = tmp_path / "case.nml"
    path.write_text("old")
    os.chown(path, 1234, 1235)
    files.write(path, "new")
    assert (path.stat().st_uid, path.stat().st_gid, path.read_text()) == (1234, 1235, "new")


def test_trouble_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a full disk; the new one is complete on the disk before it takes the name."""
    path = tmp_path / "case.nml"
    path.write_text("old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        files.write(path, "new")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    end = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    files.write(pipe, "text")
    assert os.read(end, 100) == b"text" and pipe.is_fifo()
    os.close(end)


FORMULAS = ['=HYPERLINK("http://evil")', "+1+cmd", "-A1", "@SUM(A1)", "\t=1+1", " =1"]
FIGURES = [-0.5, "-0.5", "+3", "-1.2e-7", ".5", "-", "", "A1", 3]


def test_no_name_is_a_formula(tmp_path: Path) -> None:
    """A spreadsheet shows it as the text that it is; figures stay figures."""
    rows = [{"name": name, "x": x} for name in FORMULAS for x in FIGURES]
    with files.write_table(tmp_path / "a.csv", rows).open(newline="") as file:
        found = list(csv.DictReader(file))
    assert [r["name"] for r in found] == ["'" + r["name"] for r in rows]
    assert [r["x"] for r in found] == [str(r["x"]) for r in rows]
    page = html.table(["name"], [[FORMULAS[3]], ["-0.5 to 3 m"], [html.tag("b", "=1")]])
    assert "'" + FORMULAS[3] in page.replace("&#x27;", "'") and ">-0.5 to 3 m<" in page
    assert "<b>=1</b>" in page


def test_every_table_is_written_there() -> None:
    """No other place of the tools makes CSV of texts."""
    root = Path(files.__file__).parent
    words = ("csv.writer(", "DictWriter(", ".to_csv(path,")
    makers = {p.name for p in root.rglob("*.py") if any(w in p.read_text() for w in words)}
    assert makers == {"files.py", "reader.py"}
