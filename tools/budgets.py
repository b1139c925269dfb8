"""Sizes of the house beside their budgets, `tools/budgets.toml`; `make lint` runs it.

Called once: a procedure of at most SHORT lines whose name stands once in src besides its heading
and end, `use` and `public`. Executable: no heading, declaration, comment or blank line.
"""

import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SHORT = 12
_HEADING = re.compile(r"[a-z() ]*\b(subroutine|function)\s+(\w+)")
_FRAME = re.compile(r"(use|p(ublic|r(ivate|ogram|ocedure))|i(mport|mplicit|nterface)|module"
                    r"|contains|end|generic|abstract)\b")  # fmt: skip
_DECLARATION = re.compile(r"(real|integer|logical|character|type|class|procedure)\b.*::|type \w+$")
_TYPE = re.compile(r"type\s*(,[^:]*)?(::)?\s*\w+_t\b")


def lines(*paths: Path) -> int:
    """Lines of files."""
    return sum(path.read_bytes().count(b"\n") for path in paths)


def statements(path: Path) -> Iterator[tuple[int, str, bool]]:
    """Lines of code without strings and comments: number, text, whether it goes on a statement."""
    on = False
    for number, raw in enumerate(path.read_text().splitlines(), 1):
        text = re.sub(r"'[^']*'", "''", raw).split("!")[0].strip().lower()
        if text:
            yield number, text, on
            on = text.endswith("&")


def of_fortran(paths: list[Path]) -> dict[str, float]:
    """Procedures, types, components and public names of source files."""
    length: dict[tuple[Path, str], int] = {}  # of each procedure, without those within it
    used, found = Counter[str](), Counter[str]()
    for path in paths:
        kind, within, interface, opened = "", False, False, list[Any]()
        for number, text, on in statements(path):
            if not on:
                heading = None if text.startswith("end") else _HEADING.match(text)
                if opened and re.match(r"end (subroutine|function)", text):
                    name, begin, inner = opened.pop()
                    length[path, name] = number - begin + 1 - inner
                    if opened:
                        opened[-1][2] += number - begin + 1
                if heading and not interface:
                    opened.append([heading[2], number, 0])
                if heading or _FRAME.match(text):
                    kind = "public" if text.startswith("public ::") else "frame"
                else:
                    kind = "declaration" if _DECLARATION.match(text) else "work"
                if re.match(r"(abstract )?interface\b|end interface", text):
                    interface = not text.startswith("end")
                if _TYPE.match(text):
                    within, found["derived types"] = True, found["derived types"] + 1
                elif text.startswith("end type"):
                    within = False
                elif within and "::" in text and "procedure" not in text:
                    names = re.sub(r"\([^()]*\)", "", text.split("::")[1])
                    found["components of types"] += len(names.split(","))
            if kind == "public":
                found["public names"] += len(re.findall(r"\w+", text.split("::")[-1]))
            found["work"] += kind == "work"
            if kind in ("work", "declaration"):
                used.update(re.findall(r"[a-z]\w*", text))
    return {
        "executable lines per procedure": round(found.pop("work") / len(length), 2),
        **found,
        "called once and short": sum(used[k[1]] == 1 and n <= SHORT for k, n in length.items()),
        "longest procedure": max(length.values()),
        "longest file": max(lines(path) for path in paths),
    }


def figures() -> dict[str, float]:
    """All sizes by their names."""
    src, tests = sorted((ROOT / "src").rglob("*.f90")), ROOT / "verification"
    folders = Counter[str]()
    for path in src:
        folders[str(path.parent.relative_to(ROOT))] += lines(path)
    prose = [*ROOT.glob("[RC]*.md"), *(ROOT / "docs").rglob("*.md"), *tests.rglob("*.md")]
    prose = [
        p for p in prose if "report" not in p.parts and p.stem not in ("reference", "CHANGELOG")
    ]
    return {
        "lines of src": lines(*src),
        **folders,
        "lines of Fortran tests": lines(*tests.rglob("*.f90")),
        "lines of Python": lines(*(ROOT / "tools").rglob("*.py"), *tests.rglob("*.py")),
        "words of prose": sum(len(p.read_text().split()) for p in prose),
        **of_fortran(src),
    }


def main() -> int:
    """Print what is above its goal; 1 if a budget is passed, or one is missing."""
    budgets = tomllib.loads((ROOT / "tools" / "budgets.toml").read_text())
    passed, above = [], []
    for name, value in figures().items():
        sign = -1 if name.startswith("executable") else 1
        budget, goal = budgets.get(name, (0, 0))
        if sign * value > sign * budget:
            passed.append(f"tools/budgets.toml: {name}: {value:g}, budget {budget:g}")
        elif sign * value > sign * goal:
            above.append(f"{name} {value:g} ({goal:g})")
    print("above their goals: " + ", ".join(above), *passed, sep="\n")
    return int(bool(passed))


if __name__ == "__main__":
    sys.exit(main())
