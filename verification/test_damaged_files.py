"""Files of strangers: damaged ones are refused or taken, far points and thin blocks cost little."""

import random
import re
from pathlib import Path

import pytest

from run_cases import ROOT
from soak.fuzz_files import FILES, KINDS, REFUSED, TAKEN, damaged, run, try_file

PROGRAM = ROOT / "mics"
DAMAGED = 40
"""Files of each kind; `verification/soak/fuzz_files.py` tries as many as you like."""

TANK = """&run t_end = 0.002 dt = 0.001 physics = 'dry' field_interval = 0 /
&grid cells = 6, 4, 5  length = {0}, {0}, {0} /
&contact model = '{1}' /
"""
FAR = """solid far
facet normal 0 0 1
outer loop
vertex 0 0 0.1
vertex {}
vertex 0 1 0.1
endloop
endfacet
endsolid far
"""
TETS = "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n"
POINTS = "points 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"


def check(folder: Path, text: str, command: str = "--check") -> tuple[int, str]:
    """Exit code and messages for a case."""
    (folder / "case.nml").write_text(text)
    return run(PROGRAM, [command], folder)


@pytest.mark.parametrize("kind", KINDS)
def test_good_files_are_taken(kind: str) -> None:
    """The damage makes the difference: before it every file is taken."""
    for seed in range(4):
        good = KINDS[kind].good(random.Random(seed))
        assert try_file(KINDS[kind], good, PROGRAM) == (TAKEN, "")


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files(kind: str) -> None:
    """No crash, no foreign message, soon, in little memory; some files are still good."""
    codes = set()
    for seed in range(DAMAGED):
        data = damaged(KINDS[kind], random.Random(f"{kind} {seed}"))
        code, fault = try_file(KINDS[kind], data, PROGRAM)
        assert fault == "", f"{kind} {seed}"
        codes.add(code)
    assert REFUSED in codes
    assert codes <= {TAKEN, REFUSED, FILES}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + TETS,
            "line 8: the file ends without points, the section $Nodes",
        ),
        (
            "mics-shape 1\n" + POINTS + "tets 1\n1 2 3 4\npoints 1\n0 0 0\n",
            "line 9: 'points' stands a second time",
        ),
    ],
    ids=["no points", "points twice"],
)
def test_corners_without_points(text: str, message: str, tmp_path: Path) -> None:
    """A tetrahedron with corners that do not exist never reaches the geometry."""
    (tmp_path / "stone").write_text(text)
    code, errors = check(
        tmp_path, TANK.format(1, "surface") + "&shape name = 'a' kind = 'file' file = 'stone' /"
    )
    assert (code, errors) == (2, f"mics: &shape file = 'stone': {message} (line 4)\n")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("kind = 'cylinder' size = 1e5, 0.03", "so slender a block would need 1.428e15 points on"),
        ("kind = 'cylinder' size = 1e2, 0.03", "so slender a block would need 1.43e9 points on"),
        ("kind = 'cylinder' size = 1e-3, 1e3", "its height must be at most 212 diameters with"),
        ("kind = 'cylinder' size = 1, 200 refinement = 8", "height must be at most 106 diameters"),
        ("kind = 'box' size = 1e6, 1e6, 1e-6", "cut into 1e24 cubes, at most 12500 with"),
        ("kind = 'box' size = 1e5, 1, 1 refinement = 1", "so slender a block would need 6.4e11"),
        ("kind = 'file' file = 'rod'", "so slender a block would need 2.86e7 points"),
        ("kind = 'file' file = 'rod' scale = 1e9", "is 1e12 m long, it must be between 1e-6"),
        ("kind = 'cube' size = 1 spheres = 'dense' sphere_spacing = 1e-9", "at most 20000"),
        ("kind = 'cube' size = 1 spheres = 'dense' sphere_spacing = 1e9", "its smallest edge, 1 m"),
    ],
)
def test_slender_shapes_are_refused(given: str, message: str, tmp_path: Path) -> None:
    """What would take hours or all memory is refused in a moment, with what is allowed."""
    corners = [(x, y, z) for x in (0, 1000) for y in (0, 1) for z in (0, 1)]
    tets = ["1 5 3 2", "4 3 8 2", "6 2 8 5", "7 5 8 3", "2 3 5 8"]
    rows = ["mics-shape 1 points 8", *(" ".join(map(str, c)) for c in corners), "tets 5", *tets]
    (tmp_path / "rod").write_text("\n".join(rows))
    code, errors = check(
        tmp_path, TANK.format(1e6, "surface") + f"&shape name = 'a' {given} /", "--threads=1"
    )
    assert code == 2, errors
    assert errors.startswith("mics: &shape ") and message in errors
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.nml", "rod"]


@pytest.mark.parametrize("model", ["surface", "spheres"])
@pytest.mark.parametrize(
    "given",
    [
        "kind = 'hexapod' size = 1e-6",
        "kind = 'cube' size = 1e5 refinement = 8",
        "kind = 'box' size = 60, 60, 1",
        "kind = 'box' size = 1, 1, 100",
        "kind = 'sphere' size = 1e-5",
        "kind = 'cylinder' size = 100, 1 spheres = 'inscribed'",
        "kind = 'cylinder' size = 1, 60",
        "kind = 'tetrapod' size = 1e5 refinement = 6",
        "kind = 'dolos' size = 1e-5 spheres = 'dense'",
        "kind = 'reef_cube' size = 1e5 refinement = 6",
    ],
)
def test_extreme_shapes_run(given: str, model: str, tmp_path: Path) -> None:
    """What is not refused makes its steps, in both contact models."""
    sizes = re.search(r"size = ([-+.,e\d ]+)", given)
    assert sizes
    length = min(max(4 * max(map(float, sizes[1].split(","))), 1.0), 1e6)
    place = f"position = {length / 2}, {length / 2}, {length / 2}"
    text = TANK.format(length, model) + f"&shape name = 'a' {given} /\n&body shape = 'a' {place} /"
    code, errors = check(tmp_path, text, "--quiet")
    assert (code, errors) == (0, "")


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [
        ("heightmap", "2 2 0 0 1 1\n0.1 0.1 0.1 1e8", "m high, more than 100 times the tank"),
        ("heightmap", "2 2 0 0 1 1\n1e8 1e8 1e8 1e8", "reaches up to 1e8 m, out of the tank"),
        ("heightmap", "2 2 0 0 1 1\n0.1 0.1 0.1 -1e8", "m high, more than 100 times the tank"),
        ("stl", FAR.format("1e8 0 0.1"), "it is 1e8 m long, more than 100 times the tank"),
        ("stl", FAR.format("1 0 -1e8"), "m high, more than 100 times the tank"),
        ("stl", FAR.format("1e19 1e19 1e19"), "it is 1e19 m long, more than 100 times"),
    ],
)
def test_far_points_of_a_bed(kind: str, text: str, message: str, tmp_path: Path) -> None:
    """A point far from the tank is named at once."""
    (tmp_path / "bed").write_text(text)
    case = TANK.format(1, "surface") + f"&bed file = 'bed' kind = '{kind}' /"
    code, errors = check(tmp_path, case)
    assert code == 2
    assert message in errors
