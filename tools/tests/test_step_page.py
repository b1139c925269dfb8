"""The stages of a step: its page of code and docs/architecture.md list the same, in one order."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
STEP = (ROOT / "src/step.f90").read_text()
STAGES = 14


def test_head_calls_and_documentation_list_the_same_stages() -> None:
    head = re.findall(r"^!!     (\d+) +(\w+(?: \w+)?)  ", STEP, re.MULTILINE)
    calls = re.findall(r"^ +! (\d+) (.+)$", STEP, re.MULTILINE)
    page = (ROOT / "docs/architecture.md").read_text()
    table = re.findall(r"^\| (\d+) \| ([^|]+) \|", page, re.MULTILINE)
    assert [int(number) for number, _ in head] == list(range(1, STAGES + 1))
    assert calls == head
    assert table == head


def test_the_documentation_names_procedures_of_the_stages() -> None:
    page = (ROOT / "docs/architecture.md").read_text()
    for line in re.findall(r"^\| \d+ \|.+$", page, re.MULTILINE):
        files = [ROOT / name for name in re.findall(r"`(src/[\w/]+\.f90)`", line)]
        text = STEP + "".join(file.read_text() for file in files)
        text += (ROOT / "src/coupling/coupling.f90").read_text()
        text += (ROOT / "src/momentum/fluid_transport.f90").read_text()
        for name in re.findall(r"`([a-z_]+)`", line):
            assert re.search(rf"\b{name}\b", text), f"{name} of: {line[:40]}"
