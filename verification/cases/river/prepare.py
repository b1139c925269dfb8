"""The case files: `input/river.nml`, and the same without blocks."""

import re
from pathlib import Path

TEXT = (Path(__file__).resolve().parents[3] / "input" / "river.nml").read_text()
EMPTY = re.sub(r"^&drop.*?^/", "", TEXT, flags=re.DOTALL | re.MULTILINE)
EMPTY = EMPTY.replace("stop_when_settled = .true.", "").replace("t_end = 10.0", "t_end = 6.0")

Path("blocks.nml").write_text("! cost: 100 s\n" + TEXT)
Path("empty.nml").write_text("! cost: 100 s\n" + EMPTY)
