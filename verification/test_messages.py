"""What `--check` says to a text: tables of rows `text => messages` in verification/messages.

A row is a case, or a file that a case names, with its messages behind `=>`, each on a line; `good`
means no fault, `none` no warning either, `...` at the end that others may follow, `warning:` what
the plan says. `##` begins a remark, `$name` stands for a text of STARTS, `\\x1b` for a byte.
"""

import re
import resource
import struct
import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from run_cases import ROOT
from shared_runs import texts

STARTS, NAMED = (texts("messages")[name] for name in ("starts", "named"))
RUN, GRID = STARTS["run"], STARTS["grid"]


def rows(table: str) -> Iterator[tuple[str, list[str]]]:
    """Text and messages of each row."""
    text, told = "", list[str]()
    for line in (Path(__file__).parent / "messages" / f"{table}.txt").read_text().splitlines():
        if line.startswith("##"):
            continue
        before, _, message = line.partition("=> ")
        if before.strip() and told:
            yield text, told
            text, told = "", []
        if before.strip():
            text += before.rstrip() + "\n"
        if message:
            told.append(message)
    yield text, told


def expanded(text: str) -> bytes:
    """The text of a row as it is in the file."""
    text = re.sub(r"\$(\w+)[ \n]?", lambda m: STARTS.get(m[1], m[0]), text)
    return re.sub(r"\\x(..)", lambda m: chr(int(m[1], 16)), text).encode("latin-1")


def mics(folder: Path, *words: str, text: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    """Call the program in a folder with a case as its standard input; it has 20 s and 4 GB."""
    command, memory = [str(ROOT / "mics"), *words], (resource.RLIMIT_AS, (4 << 30, 4 << 30))
    return subprocess.run(command, cwd=folder, input=text, capture_output=True, timeout=20,
                          preexec_fn=partial(resource.setrlimit, *memory))  # fmt: skip


def messages(folder: Path, case: bytes) -> list[str]:
    """All that is wrong with a case, else all that the plan warns of; nothing is written."""
    before = sorted(folder.iterdir())
    done = mics(folder, "--check", text=case)
    problems = re.findall("(?m)^mics: (.*)$", done.stderr.decode())
    assert done.returncode == (2 if problems else 0), done.stderr
    assert sorted(folder.iterdir()) == before
    return problems or re.findall("(?m)^ *(warning: .*)$", done.stdout.decode())


def compare(found: list[str], told: list[str]) -> None:
    """The messages of a row are those found; `...` at their end lets others follow."""
    if told[-1].endswith(" ..."):
        told = [*told[:-1], told[-1].removesuffix(" ...")]
        found = found[: len(told)]
    if told == ["none"]:
        assert found == []
    elif told == ["good"]:
        assert all(line.startswith("warning: ") for line in found), found
    else:
        assert found == told


@pytest.mark.parametrize(("text", "told"), list(rows("case")))
def test_case(text: str, told: list[str], tmp_path: Path) -> None:
    """A text as the case."""
    compare(messages(tmp_path, expanded(text)), told)


def of_file(folder: Path, table: str, content: bytes) -> list[str]:
    """Messages about a file of a case, without the group and its line."""
    (folder / "f").write_bytes(content)
    found = messages(folder, f"{RUN}{GRID}{NAMED[table]}\n".encode())
    return [re.sub(r"^&\w+ \w+ = 'f': (.*) \(line 3\)$", r"\1", line) for line in found]


@pytest.mark.parametrize(
    ("table", "text", "told"), [(t, text, told) for t in NAMED for text, told in rows(t)]
)
def test_file(table: str, text: str, told: list[str], tmp_path: Path) -> None:
    """A text as a shape, a bed, a plan or a way."""
    compare(of_file(tmp_path, table, expanded(text)), told)


FIVE = ((1, 2, 3, 5), (4, 3, 2, 8), (6, 2, 5, 8), (7, 5, 3, 8), (2, 3, 5, 8))
"""The tetrahedra of a cube with the corners of STARTS."""
APART = "falls into 2 separate pieces"
JOINED = "{} points stand in the place of another, join them"


@pytest.mark.parametrize(
    ("shifts", "told"),
    [
        ([(0, 0, 0), (2, 2, 2)], APART),
        ([(0, 0, 0), (0, 2, 0)], APART),
        *(([(0, 0, 0), shift], JOINED.format(4)) for shift in ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
        *(([(0, 0, 0), shift], JOINED.format(4)) for shift in ((-1, 0, 0), (0, -1, 0), (0, 0, -1))),
        ([(k, 0, 0) for k in range(4)], JOINED.format(12)),
    ],
)
def test_cubes_in_a_row(shifts: list[tuple[int, int, int]], told: str, tmp_path: Path) -> None:
    """Cubes that do not share their points: each point is counted once, wherever it stands."""
    corners = [int(word) for word in STARTS["corners"].split()]
    points = [x + shift[i % 3] for shift in shifts for i, x in enumerate(corners)]
    tets = [c + 8 * k for k in range(len(shifts)) for tet in FIVE for c in tet]
    text = f"mics-shape 1 points {len(points) // 3} {points} tets {len(tets) // 4} {tets}"
    assert of_file(tmp_path, "shape", re.sub(r"[\[\],]", "", text).encode()) == [told]


def test_long_word(tmp_path: Path) -> None:
    """A message shows the start of a word without an end."""
    told = f"line 1: '{57 * 'x'}...' stands where 'points' or 'tets' should"
    assert of_file(tmp_path, "shape", b"mics-shape 1 " + 100000 * b"x") == [told]


def binary_stl(offset: float, more: bytes = b"") -> bytes:
    """A facet, one metre long."""
    corners = [x + offset for x in (0, 0, 0.1, 1, 0, 0.2, 0, 1, 0.3)]
    return b"solid".ljust(80) + struct.pack("<i12f2s", 1, 0, 0, 1, *corners, b"xx") + more


CAPITALS = b"""SOLID A\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 .1\nVertex 1 0 .2\nvertex 0 1 .3
ENDLOOP\nENDFACET\nENDSOLID A\n"""
FAR = b"solid\nfacet\nvertex 5621080 0 0\nvertex 5621080.5 0 0\nvertex %s\nendfacet"


@pytest.mark.parametrize(
    ("kind", "content", "told"),
    [
        ("heightmap", binary_stl(0), "looks like an STL or another binary file, not a map of"),
        ("heightmap", CAPITALS, "an STL file is read with kind = 'stl'"),
        ("stl", binary_stl(0), ""),
        ("stl", binary_stl(0, b"\n"), ""),
        ("stl", CAPITALS, ""),
        ("stl", CAPITALS.replace(b"END", b"end "), ""),
        ("stl", binary_stl(0, 50 * b"x"), "the file holds no facets"),
        ("stl", binary_stl(4e6), "lies too far from zero: coordinates of 4000001 m are rounded"),
        ("stl", FAR % b"5621081.1 0 0", "lies too far from zero"),
        ("stl", FAR % b"5621080 .1 0", "outside the tank"),
    ],
)
def test_stl(kind: str, content: bytes, told: str, tmp_path: Path) -> None:
    """Binary or a text in capitals, with a byte too much, and coordinates of a survey."""
    found = [line for line in of_file(tmp_path, kind, content) if "warning" not in line]
    assert (told in found[0]) if told else not found, found
    plan = mics(tmp_path, "--check", text=f"{RUN}{GRID}{NAMED[kind]}\n".encode()).stdout.decode()
    assert told or " f, 1 facets, heights from 0.1 to 0.3 m" in plan


def pyramid(x: float, edge: float = 0.03, how: int = 1) -> str:
    """A tetrahedron as STL: -1 inside out, 0 without a facet, 2 twice."""
    corners = [[x, 0.03, 0.02] for _ in range(4)]
    for axis in range(3):
        corners[axis + 1][axis] += edge
    lines = ["solid pyramid"]
    for copy in range(max(1, how)):
        for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))[: 3 if how == 0 else 4]:
            lines += ["facet normal 0 0 0", "outer loop"]
            for corner in face[::-1] if how < 0 else face:
                lines.append("vertex " + " ".join(repr(c + 0.005 * copy) for c in corners[corner]))
            lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid pyramid", ""])


def slope() -> str:
    """A map of a plane, 0.15 m by 0.12 m from x = -0.013 m on."""
    heights = [
        0.31 * (0.03 * i - 0.013) - 0.17 * 0.03 * j + 0.02 for j in range(5) for i in range(6)
    ]
    return f"6 5 -0.013 0 0.03 0.03\n{' '.join(map(str, heights))}\n"


PERIODIC = "x_min = 'periodic' x_max = 'periodic' y_min = 'slip' y_max = 'slip'"


@pytest.mark.parametrize(
    ("kind", "content", "place", "told"),
    [
        ("heightmap", slope(), {}, ""),
        ("heightmap", slope(), {"x": -0.02}, "the map does not cover the tank"),
        ("heightmap", slope(), {"top": 0.04}, "out of the tank"),
        ("heightmap", slope(), {"z": 0.06}, "the bed lies below the tank"),
        ("heightmap", slope(), {"sides": PERIODIC}, "as long as the period"),
        ("heightmap", "2 2 0 0 .1 .1\n.01 .04 .01 .04", {"sides": PERIODIC}, "at both ends of a"),
        ("heightmap", "2 2 0 0 .1 .1\n.01 .01 .01 .01", {"sides": PERIODIC}, ""),
        ("heightmap", "2 2 0 0 100 100\n20 20 20 20", {}, "are its coordinates in mm?"),
        ("stl", pyramid(0.03), {}, ""),
        ("stl", pyramid(0.03, how=-1), {}, "looks down with no solid above it"),
        ("stl", pyramid(0.03, how=0), {}, "open edges inside the tank"),
        ("stl", pyramid(0.03, how=2), {}, "solid lies in solid"),
        ("stl", pyramid(0.53), {}, "outside the tank in x"),
        ("stl", pyramid(354200.03, how=-1), {"x": 354200}, "x, y, z = 354200.0"),
    ],
)
def test_bed_in_tank(
    kind: str, content: str, place: dict[str, float | str], told: str, tmp_path: Path
) -> None:
    """A bed covers its tank, lies in it and is closed."""
    (tmp_path / "f").write_text(content)
    case = (
        f"{RUN}&grid cells = 7, 5, 9 length = 0.1, 0.08, {place.get('top', 0.09)} "
        f"origin = {place.get('x', 0)}, 0.01, {place.get('z', 0)} /\n{NAMED[kind]}\n"
        f"&boundary {place.get('sides', '')} /\n"
    )
    found = messages(tmp_path, case.encode())
    found = [line for line in found if not line.startswith("warning: ")]
    assert len(found) == (told != "") and all(told in line for line in found), found


TEXTS = {
    "Latin-1": (b"B\xf6e\xe4\xdf", "Böeäß"),
    "two and three bytes": ("ö≤".encode(), "ö≤"),
    "four bytes": ("🌊".encode(), "🌊"),
    "cut off": (b"\xc3", "Ã"),
    "overlong": (b"\xc0\x80a", "À\x80a"),
    "surrogate": (b"\xed\xa0\x80", "í\xa0\x80"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_encoding(name: str, tmp_path: Path) -> None:
    """A text in UTF-8 stays, any other is Latin-1; blanks that do not break are blanks."""
    content, shown = TEXTS[name]
    shown = shown.replace("\x80", "??")  # a control character
    case = (RUN + GRID).encode() + b"&numerics advection = '" + content + b"' /\n"
    told = (
        f"&numerics advection = '{shown}': unknown, must be one of 'mp5', 'tvd5', 'upwind' (line 3)"
    )
    assert messages(tmp_path, case) == [told]


def test_blanks_that_do_not_break(tmp_path: Path) -> None:
    """As word processors write them: blanks, but in strings."""
    b = "\xa0"
    case = f"{b}! it's{b}\n&run{b}t_end{b}={b}1{b}title = 'a{b}\"'{b}dt{b}={b}x{b}/{b}\n{GRID}"
    assert messages(tmp_path, case.encode()) == ["&run dt = x: must be a number (line 2)"]
    case = case.replace(f"title = 'a{b}\"'", f"physics = 'a{b}\"'").replace(f"{b}x{b}", f"{b}1{b}")
    assert messages(tmp_path, case.encode())[0].startswith(f"&run physics = 'a{b}\"': unknown")


def test_forms(tmp_path: Path) -> None:
    """Everything a good text may do arrives: remarks, quotes, counts, separators, two on a line."""
    case = (
        "! a case: schön, größe &run t_end = 1 /\n"
        "&Run title = 'a / b ! c, it''s \"so\"', T_END=10.0 dt  =\n"
        "  1.0e-2 ! comment with a ' and a /\n"
        "/\n"
        " &grid cells = 3*4, length = 0.3 0.1,0.2, / &fluid\tgravity=0,0 -9.81/\n"
        '&numerics advection = "say ""yes""" solid_fraction=\'\'/\n'
        "&contact/\n"
    )
    assert messages(tmp_path, case.encode()) == [
        "&numerics advection = 'say \"yes\"': unknown, must be one of 'mp5', 'tvd5', 'upwind' "
        "(line 6)",
        "&numerics solid_fraction = '': unknown, must be one of 'exact', 'subcell' (line 6)",
    ]
    case = case.replace('advection = "say ""yes""" solid_fraction=\'\'', "")
    plan = mics(tmp_path, "--check", text=case.encode()).stdout.decode()
    assert 'a / b ! c, it\'s "so"' in plan and "4 x 4 x 4 = 64" in plan


@pytest.mark.parametrize(("words", "told"), list(rows("options")))
def test_options(words: str, told: list[str], tmp_path: Path) -> None:
    """A mistake in the command is named, with the nearest option."""
    done = mics(tmp_path, *words.split())
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.decode() == f"mics: {told[0]}\n"
