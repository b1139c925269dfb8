"""Surfaces to blocks: volumes kept, faults of drawings repaired with a warning or refused."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from micstools import meshing
from micstools.shapes import hexapod

trimesh = pytest.importorskip("trimesh")
ROOT = Path(__file__).parents[2]
D = 20.0  # edge of the cubes [mm]


def hexapod_surface() -> "trimesh.Trimesh":
    """The paper's block in mm, 60 triangles."""
    shape = hexapod(D, 1)
    return trimesh.Trimesh(shape.points, shape.triangles)


def save(mesh: "trimesh.Trimesh", path: Path) -> Path:
    mesh.export(path)
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


def test_curved_block_keeps_its_volume(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=30.0)
    surface = meshing.load(save(ball, tmp_path / "ball.stl"))
    total = meshing.tet_volumes(meshing.fill(surface)).sum()
    assert abs(total) == pytest.approx(ball.volume, rel=1e-6)


def test_step_file_has_the_volume_of_its_form(tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 60, 20)
    gmsh.model.occ.synchronize()
    gmsh.write(str(tmp_path / "cylinder.step"))
    gmsh.finalize()
    surface = meshing.load(tmp_path / "cylinder.step", 4.0)
    total = abs(meshing.tet_volumes(meshing.fill(surface)).sum())
    assert total == pytest.approx(np.pi * 20**2 * 60, rel=0.01)
    with pytest.raises(meshing.BadSurface, match="smaller --element"):
        meshing.closed(surface.points, surface.triangles, 1.02 * total)


def test_holes_are_filled_with_a_warning(tmp_path: Path) -> None:
    mesh = hexapod_surface()
    mesh.update_faces(np.arange(len(mesh.faces)) != 7)
    surface = meshing.load(save(mesh, tmp_path / "holed.stl"))
    assert surface.warnings == ["the surface was open at 3 edges; 1 plane hole was filled"]
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


def test_pieces_and_hollows_are_refused() -> None:
    box = trimesh.creation.box((20, 20, 20))
    apart = box.copy().apply_translation((50, 0, 0))
    hollow = trimesh.creation.box((5, 5, 5))
    hollow.invert()
    for second in (apart, hollow):
        both = trimesh.util.concatenate([box, second])
        with pytest.raises(meshing.BadSurface, match="surface is in 2 pieces"):
            meshing.closed(both.vertices, both.faces)


def test_a_surface_that_is_far_from_closed_is_refused(tmp_path: Path) -> None:
    mesh = hexapod_surface()
    mesh.update_faces(np.arange(len(mesh.faces)) % 3 > 0)
    with pytest.raises(meshing.BadSurface, match="surface is open"):
        meshing.load(save(mesh, tmp_path / "open.stl"))


def test_flipped_triangles_are_turned_with_a_warning(tmp_path: Path) -> None:
    mesh = hexapod_surface()
    mesh.faces[::7] = mesh.faces[::7, ::-1]
    surface = meshing.load(save(mesh, tmp_path / "flipped.stl"))
    assert "seen from inside" in surface.warnings[0]
    assert surface.volume == pytest.approx(7 * D**3, rel=1e-6)


def test_overlapping_parts_are_refused(tmp_path: Path) -> None:
    boxes = [trimesh.creation.box((20, 20, 20)) for _ in range(2)]
    boxes[1].apply_translation((10, 5, 3))
    both = trimesh.util.concatenate(boxes)
    with pytest.raises(meshing.BadSurface, match="2 pieces"):
        meshing.load(save(both, tmp_path / "two.stl"))
    with pytest.raises(meshing.BadSurface, match="meets itself"):
        meshing.fill(meshing.Surface(both.vertices, both.faces, both.volume))


def test_millimetres_read_as_metres_are_noticed(tmp_path: Path) -> None:
    surface = meshing.load(save(hexapod_surface(), tmp_path / "block.stl"))
    with pytest.raises(meshing.BadSurface, match=r"60 m long.*--scale 0\.001"):
        meshing.scale_of(surface, None, None)
    assert meshing.scale_of(surface, None, 1e-3) == 1e-3
    assert meshing.scale_of(surface, 0.06, None) == pytest.approx(1e-3)
    assert surface.warnings == []


def test_centimetres_read_as_metres_are_noticed(tmp_path: Path) -> None:
    mesh = hexapod_surface()
    mesh.apply_scale(0.1)
    surface = meshing.load(save(mesh, tmp_path / "block.stl"))
    assert meshing.scale_of(surface, None, None) == 1.0
    assert re.search(r"6 m long.*in cm --scale 0\.01", surface.warnings[0])
    small = meshing.Surface(surface.points / 100, surface.triangles, surface.volume / 1e6)
    assert meshing.scale_of(small, None, None) == 1.0
    assert small.warnings == []


def test_script_writes_a_file_the_program_reads(tmp_path: Path) -> None:
    save(hexapod_surface(), tmp_path / "block.stl")
    script = [sys.executable, ROOT / "tools" / "make_shape.py", "block.stl", "--size", "0.06"]
    done = subprocess.run(
        [*script, "--out", "block.txt", "--no-picture"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert re.search(r"volume +5\.6e-05 m3", done.stdout)
    assert "weight" in done.stdout and "inertia x" in done.stdout
    if not (ROOT / "mics").exists():
        pytest.skip("./mics is not built")
    case = (
        "&run t_end = 1 /\n&grid cells = 6, 4, 4  length = 0.3, 0.2, 0.2 /\n"
        "&shape name = 'b'  kind = 'file'  file = 'block.txt' /\n"
    )
    plan = subprocess.run(
        [ROOT / "mics", "--check"], cwd=tmp_path, input=case, capture_output=True, text=True
    )
    assert plan.returncode == 0, plan.stderr
    assert "0.06 x 0.06 x 0.06 m, 30 facets" in plan.stdout


def test_script_refuses_a_bad_file(tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_text("solid nothing\nendsolid nothing\n")
    done = subprocess.run(
        [sys.executable, ROOT / "tools" / "make_shape.py", "bad.stl", "--out", "block.txt"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("make_shape: ")
    assert not (tmp_path / "block.txt").exists()
