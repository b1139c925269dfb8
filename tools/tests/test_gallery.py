"""The gallery shows what it says: its cases, their folders and its pictures are there."""

import re
from pathlib import Path

from fences import fences
from micstools.cases import settings

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "gallery.md"


def test_every_case_has_its_picture_and_its_commands() -> None:
    text = PAGE.read_text()
    cases = {path.name for path in (ROOT / "input").glob("*.nml")} - {"blocks_paper.nml"}
    assert set(re.findall(r"./mics < input/(\S+)", text)) == cases
    for figure in re.findall(r"\]\((figures/\S+)\)", text):
        assert (PAGE.parent / figure).is_file()
    for _, commands in fences(PAGE):
        case, folder = re.findall(r"input/(\S+)|plot (\S+)", commands)
        run = (ROOT / "input" / case[0]).read_text()
        assert settings.value(run, "run", "output") == folder[1]
        latest = float(re.findall(r"--times (?:\S+ )*?(\S+) --view", commands)[0])
        assert latest <= settings.value(run, "run", "t_end")
