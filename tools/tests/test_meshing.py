"""Surfaces to blocks: volumes kept, faults of drawings repaired with a warning or refused."""

import re
from codecs import BOM_UTF8
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calls import ROOT, mics_tools, needs_mics, plan_of, python
from micstools.shapes import meshing
from micstools.shapes.shape import hexapod

trimesh = pytest.importorskip("trimesh")
D = 20.0  # edge of the cubes [mm]


def hexapod_surface() -> "trimesh.Trimesh":
    """The paper's block in mm, 60 triangles."""
    shape = hexapod(D, 1)
    return trimesh.Trimesh(shape.points, shape.triangles)


def save(mesh: "trimesh.Trimesh", path: Path) -> Path:
    mesh.export(path)
    return path


def step_file(path: Path, *solids: tuple) -> Path:
    """Solids of Open CASCADE by gmsh: their names and sizes [mm]."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for kind, *sizes in solids:
        getattr(gmsh.model.occ, f"add{kind}")(*sizes)
    gmsh.model.occ.synchronize()
    gmsh.write(str(path))
    gmsh.finalize()
    return path


@pytest.mark.parametrize("suffix", [".stl", ".obj"])
def test_hexapod_keeps_volume_inertia_and_facets(suffix: str, tmp_path: Path) -> None:
    surface = meshing.load(save(hexapod_surface(), tmp_path / f"block{suffix}"))
    assert surface.warnings == []
    shape, centroid = meshing.block("block", 1e-3 * meshing.fill(surface), 2300.0)
    assert shape.volume == pytest.approx(7 * 0.02**3, rel=1e-6)
    assert shape.inertia == pytest.approx(31 / 6 * 2300 * 0.02**5 * np.eye(3), rel=1e-6, abs=1e-11)
    assert centroid == pytest.approx(np.zeros(3), abs=1e-8)
    assert len(shape.triangles) == 60


def test_curved_blocks_keep_their_volumes(tmp_path: Path) -> None:
    """A ball as it is drawn, and a cylinder of a STEP file within the element."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=30.0)
    surface = meshing.load(save(ball, tmp_path / "ball.stl"))
    total = abs(meshing.tet_volumes(meshing.fill(surface)).sum())
    assert total == pytest.approx(ball.volume, rel=1e-6)
    path = step_file(tmp_path / "cylinder.step", ("Cylinder", 0, 0, 0, 0, 0, 60, 20))
    surface = meshing.load(path, 4.0)
    total = abs(meshing.tet_volumes(meshing.fill(surface)).sum())
    assert total == pytest.approx(np.pi * 20**2 * 60, rel=0.01)
    with pytest.raises(meshing.BadSurface, match="smaller --element"):
        meshing.closed(surface.points, surface.triangles, 1.02 * total)


def test_faults_are_mended_with_a_warning(tmp_path: Path) -> None:
    holed, flipped = hexapod_surface(), hexapod_surface()
    holed.update_faces(np.arange(len(holed.faces)) != 7)
    flipped.faces[::7] = flipped.faces[::7, ::-1]
    for mesh, told in (
        (holed, "the surface was open at 3 edges; 1 plane hole was filled"),
        (flipped, "some or all triangles were seen from inside; they were turned"),
    ):
        surface = meshing.load(save(mesh, tmp_path / "a.stl"))
        assert surface.warnings == [told]
        assert surface.volume == pytest.approx(7 * D**3, rel=1e-6)


def test_plane_holes_of_any_form_are_filled_exactly(tmp_path: Path) -> None:
    corners = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (3, 2), (3, 3), (0, 3), (0, 1.5)]
    n = len(corners)
    points = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in corners])
    sides = [(k, (k + 1) % n, (k + 1) % n + n) for k in range(n)]
    sides += [(k, (k + 1) % n + n, k + n) for k in range(n)]
    for order in (1, -1):  # seen from outside, and from inside
        surface = meshing.closed(points, np.array(sides)[:, ::order])
        assert "2 plane holes were filled" in surface.warnings[0]
        assert surface.volume == pytest.approx(7.0, rel=1e-12)
        assert np.abs(meshing.tet_volumes(meshing.fill(surface))).sum() == pytest.approx(7.0)


def test_holes_that_are_not_plane_are_refused() -> None:
    """A box without a triangle on each of two sides: a filling across the edge would cut it off."""
    box = trimesh.creation.box((20, 10, 10))
    normals, corners = np.asarray(box.face_normals), np.asarray(box.faces)
    outcomes = set()
    for other in range(1, len(corners)):
        if normals[0] @ normals[other] > 0.5:
            continue
        faces = np.delete(corners, [0, other], axis=0)
        shared = len(set(corners[0]) & set(corners[other]))
        outcomes.add(shared)
        if shared == 0:
            assert meshing.closed(box.vertices, faces).volume == pytest.approx(2000.0)
            continue
        reason = "two holes meet at a point" if shared == 1 else "between 4 edges is not plane"
        with pytest.raises(meshing.BadSurface, match=reason):
            meshing.closed(box.vertices, faces)
    assert outcomes == {0, 1, 2}
    many = hexapod_surface()
    with pytest.raises(meshing.BadSurface, match="surface is open"):
        meshing.closed(many.vertices, many.faces[np.arange(len(many.faces)) % 3 > 0])


def test_pieces_and_hollows_are_refused() -> None:
    small, hollow = trimesh.creation.box((5, 5, 5)), trimesh.creation.box((5, 5, 5))
    hollow.invert()
    for second, said in (
        (boxes((50, 0, 0)), "surface is in 2 pieces"),
        (hollow, "surface is in 2 pieces"),
        (small, "part 2 of 2 lies inside the others"),
    ):
        both = trimesh.util.concatenate([boxes((0, 0, 0)), second])
        with pytest.raises(meshing.BadSurface, match=said):
            meshing.closed(both.vertices, both.faces)


def points_and_triangles(obj: bytes) -> bytes:
    return b"\n".join(line for line in obj.splitlines() if line.startswith((b"v ", b"f ")))


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("stl_ascii", bytes.upper),
        ("stl_ascii", lambda b: b.replace(b"endsolid", b"ENDSOLID hexapod")),
        ("stl_ascii", lambda b: b.replace(b"endsolid", b"end solid").replace(b"dloop", b"d Loop")),
        ("stl_ascii", lambda b: BOM_UTF8 + b),
        ("obj", lambda b: BOM_UTF8 + points_and_triangles(b)),  # it hides no point
        ("stl", lambda b: b + b"\n"),
        ("stl", lambda b: b + bytes(49)),
    ],
)
def test_a_file_of_any_writing_is_read(
    tmp_path: Path, kind: str, change: Callable[[bytes], bytes]
) -> None:
    """Capitals, blanks, byte-order marks, and bytes behind the end."""
    content = hexapod_surface().export(file_type=kind)
    path = tmp_path / f"a.{kind[:3]}"
    path.write_bytes(change(content.encode() if isinstance(content, str) else content))
    assert meshing.load(path).volume == pytest.approx(7 * D**3, rel=1e-6)


@pytest.mark.parametrize("kind", ["3mf", "ply", "off", "glb", "stl", "dae"])
@pytest.mark.parametrize("content", [b"", b"PK\3\4 no archive", b"ply\n\0\xff", bytes(200)])
def test_a_drawing_that_is_none_is_one_line(tmp_path: Path, kind: str, content: bytes) -> None:
    path = tmp_path / f"a.{kind}"
    path.write_bytes(content)
    with pytest.raises(meshing.BadSurface):
        meshing.load(path)


def test_a_surface_that_rounding_has_spoiled_is_refused(tmp_path: Path) -> None:
    """At the coordinates of a survey; a drawing that keeps all digits is taken there."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    for radius in (2.0, 20.0, 200.0):  # less than COARSE steps of 0.5, and more
        far = ball.copy().apply_scale(radius).apply_translation((354200.0, 5621080.0, 0.0))
        if radius == 200.0:
            far.update_faces(np.arange(len(far.faces)) % 3 > 0)
        with pytest.raises(meshing.BadSurface, match=r"too far from zero: .* 562\d+ .* to 0.5 "):
            meshing.load(save(far, tmp_path / "a.stl"))
    ball.apply_translation((5e6 + 0.1, 0.0, 0.0))
    found = meshing.load(save(ball, tmp_path / "a.obj"))
    assert found.volume == pytest.approx(ball.volume, rel=1e-4)


def boxes(*places: tuple[float, float, float]) -> "trimesh.Trimesh":
    """Cubes of 20 mm in one file."""
    found = [trimesh.creation.box((20, 20, 20)).apply_translation(place) for place in places]
    return trimesh.util.concatenate(found)


def test_overlapping_parts_are_united(tmp_path: Path) -> None:
    both = boxes((0, 0, 0), (10, 5, 3))
    surface = meshing.load(save(both, tmp_path / "two.stl"))
    true = 2 * 20**3 - 10 * 15 * 17
    assert surface.volume == pytest.approx(true, rel=1e-6)
    assert surface.warnings == ["2 parts were united: -15.94% of their volumes together"]
    assert np.abs(meshing.tet_volumes(meshing.fill(surface))).sum() == pytest.approx(true, rel=1e-6)
    with pytest.raises(meshing.BadSurface, match="meets itself"):
        meshing.fill(meshing.Surface(both.vertices, both.faces, both.volume))
    whole, mixed = both.faces[:, ::-1], both.faces.copy()
    mixed[::5] = mixed[::5, ::-1]
    for faces in (whole, mixed):  # seen from inside
        assert meshing.closed(both.vertices, faces).volume == pytest.approx(true, rel=1e-9)


def test_round_parts_are_united(tmp_path: Path) -> None:
    """Three bars through one another, each a prism of 24 sides, in any attitude."""
    bar = trimesh.creation.cylinder(radius=8.0, height=60.0, sections=24)
    turns = [np.eye(4), trimesh.transformations.rotation_matrix(1.2, (1, 0.3, 0)),
             trimesh.transformations.rotation_matrix(1.4, (0.2, 1, 0.1))]  # fmt: skip
    found = trimesh.util.concatenate([bar.copy().apply_transform(turn) for turn in turns])
    surface = meshing.load(save(found, tmp_path / "cross.stl"))
    rng = np.random.default_rng(1)
    low, high = found.bounds
    points = low + rng.random((400_000, 3)) * (high - low)
    inside = np.zeros(len(points), dtype=bool)
    for turn in turns:
        own = np.abs((points @ turn[:3, :3])[:, 2]) < 30
        inside |= own & (np.linalg.norm((points @ turn[:3, :3])[:, :2], axis=1) < 8)
    share = float(inside.mean())
    rel = 4 * np.sqrt((1 - share) / share / 40000) + 0.02
    assert surface.volume == pytest.approx(share * np.prod(high - low), rel=rel)
    shape, _ = meshing.block("cross", 1e-3 * meshing.fill(surface), 2300.0)
    assert shape.volume == pytest.approx(1e-9 * surface.volume, rel=1e-6)


def test_solids_of_a_step_file_are_united(tmp_path: Path) -> None:
    first = ("Box", 0, 0, 0, 20, 20, 20)
    near, far = (
        step_file(tmp_path / f"{x}.step", first, ("Box", x, 5, 3, 20, 20, 20)) for x in (10, 50)
    )
    surface = meshing.load(near)
    assert surface.warnings == ["2 parts were united: -15.94% of their volumes together"]
    assert surface.volume == pytest.approx(2 * 20**3 - 10 * 15 * 17, rel=1e-9)
    with pytest.raises(meshing.BadSurface, match="holds 2 solids apart"):
        meshing.load(far)


def test_a_fine_surface_is_simplified_on_request(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=30.0)
    ball.vertices *= (1.0 + 0.1 * np.sin(ball.vertices[:, 0] / 6))[:, None]
    fine = meshing.load(save(ball, tmp_path / "rock.stl"))
    coarse = meshing.simplified(fine, 400)
    assert len(fine.triangles) == 5120 and 390 <= len(coarse.triangles) <= 400
    change = coarse.volume / fine.volume - 1
    assert abs(change) < 0.02
    assert coarse.warnings == [
        f"5120 triangles were simplified to {len(coarse.triangles)}: {change:+.2%} of the volume"
    ]
    assert np.abs(meshing.tet_volumes(meshing.fill(coarse))).sum() == pytest.approx(coarse.volume)
    assert np.ptp(coarse.points, axis=0) == pytest.approx(np.ptp(fine.points, axis=0), rel=0.05)
    assert meshing.simplified(coarse, 400) is coarse
    with pytest.raises(meshing.BadSurface, match="4 triangles at least"):
        meshing.simplified(coarse, 3)


@pytest.mark.parametrize("faces", [5, 30])
def test_a_surface_that_does_not_stay_closed_is_refused(faces: int) -> None:
    bars = [trimesh.creation.box(np.roll((60.0, 20.0, 20.0), k)) for k in range(3)]
    cross = trimesh.util.concatenate(bars)
    with pytest.raises(meshing.BadSurface, match="with so few the surface does not stay closed"):
        meshing.simplified(meshing.closed(cross.vertices, cross.faces), faces)


def test_plane_faces_are_simplified_without_a_change(tmp_path: Path) -> None:
    mesh = hexapod_surface()
    for _ in range(3):
        mesh = mesh.subdivide()
    surface = meshing.simplified(meshing.load(save(mesh, tmp_path / "fine.stl")), 60)
    assert len(surface.triangles) <= 60
    assert surface.volume == pytest.approx(7 * D**3, rel=1e-6)


def test_other_units_read_as_metres_are_noticed(tmp_path: Path) -> None:
    """Millimetres are refused, centimetres, as of a large block, told."""
    surface = meshing.load(save(hexapod_surface(), tmp_path / "block.stl"))
    with pytest.raises(meshing.BadSurface, match=r"60 m long.*--scale 0\.001"):
        meshing.scale_of(surface, None, None)
    assert meshing.scale_of(surface, None, 1e-3) == 1e-3
    assert meshing.scale_of(surface, 0.06, None) == pytest.approx(1e-3)
    assert surface.warnings == []
    large, small = (
        meshing.Surface(surface.points / n, surface.triangles, surface.volume / n**3)
        for n in (10, 1000)
    )
    assert meshing.scale_of(large, None, None) == meshing.scale_of(small, None, None) == 1.0
    assert re.search(r"6 m long.*in cm --scale 0\.01", large.warnings[0])
    assert small.warnings == []


@needs_mics
def test_script_writes_a_file_the_program_reads(tmp_path: Path) -> None:
    save(hexapod_surface(), tmp_path / "block.stl")
    words = ("block.stl", "--size", "0.06", "--out", "block.txt", "--no-picture")
    done = python(ROOT / "tools" / "make_shape.py", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"volume +5\.6e-05 m3", done.stdout)
    assert re.search(r"weight +1\.26\d* N", done.stdout) and "inertia x" in done.stdout
    case = (
        "&run t_end = 1 /\n&grid cells = 6, 4, 4  length = 0.3, 0.2, 0.2 /\n"
        "&shape name = 'b'  kind = 'file'  file = 'block.txt' /\n"
    )
    assert "0.06 x 0.06 x 0.06 m, 30 facets" in plan_of(tmp_path, case)


def test_the_command_simplifies_and_unites(tmp_path: Path, capsys) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=12.0)
    both = trimesh.util.concatenate([ball, boxes((12, 0, 0))])
    path, out = save(both, tmp_path / "two.stl"), tmp_path / "block.txt"
    words = ["--scale", "0.001", "--out", str(out), "--no-picture", "--simplify"]
    assert mics_tools(["shape", str(path), *words, "300"]) == 0
    said = capsys.readouterr()
    assert out.exists()
    united, fewer = said.err.splitlines()
    assert re.fullmatch(r"warning: 2 parts were united: -\d+\.\d+% of .*", united)
    assert re.fullmatch(r"warning: \d+ triangles were simplified to \d+: .* of the volume", fewer)
    out.unlink()
    assert mics_tools(["shape", str(path), *words, "2"]) == 2 and not out.exists()
    (*_, line) = capsys.readouterr().err.splitlines()
    assert "mics-tools shape: --simplify 2: a closed surface has 4 triangles at least" in line


@pytest.mark.parametrize(("unit", "metres"), [(".MILLI.", 0.06), ("$", 60.0)])
def test_a_step_file_tells_its_unit(unit: str, metres: float, tmp_path: Path) -> None:
    path = step_file(tmp_path / "box.step", ("Box", 0, 0, 0, 60, 20, 20))
    text = path.read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    path.write_text(text.replace("(.MILLI.,.METRE.)", f"({unit},.METRE.)"))
    surface = meshing.load(path)
    assert meshing.scale_of(surface, None, None) * surface.length == pytest.approx(metres)
    assert meshing.scale_of(surface, None, 0.001) * surface.length == pytest.approx(metres)
    assert surface.warnings == []
    assert meshing.scale_of(surface, None, 1.0) == 1.0
    assert "by its own unit the block is" in surface.warnings[0]
