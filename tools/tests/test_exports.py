"""What is exported is read back by other programs and holds the run."""

import csv
import json
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

from calls import mics_tools
from micstools.pictures import exports, scene
from micstools.reading.reader import Run
from synthetic import Motion, write_run

can_draw = pytest.mark.skipif(bool(scene.missing_libraries()), reason=scene.missing_libraries())


def test_the_table_holds_every_row(loose_pile: Run, tmp_path: Path) -> None:
    b = loose_pile.bodies
    with exports.to_csv(loose_pile, 0, tmp_path).open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(b.time) * b.n
    line = table[150 * b.n + 4]
    assert (line["block"], line["shape"], line["released"]) == ("5", "hexapod", "1")
    assert [float(line[name]) for name in ("time", "x", "qz", "vz")] == [
        b.time[150], b.position[150, 4, 0], b.quaternion[150, 4, 3], b.velocity[150, 4, 2]
    ]  # fmt: skip
    assert table[9 * 10 + 8]["released"] == "0"


def test_the_final_table_holds_places_and_attitudes(make_run, capsys) -> None:
    run = make_run(Motion(t_end=2.0, field_step=2.0))  # too late for the third and later ones
    b = run.bodies
    assert mics_tools(["export", str(run.folder), "--to", "csv", "--final"]) == 0
    said = capsys.readouterr()
    path = run.folder / "export" / "final.csv"
    assert said.out == f"{path}\n"
    assert "left out, not in the tank at the end: 6, 7, 8, 9" in said.err
    assert not (run.folder / "export" / "blocks.csv").exists()
    with path.open() as file:
        table = list(csv.DictReader(file))
    heads = ["block", "shape", "fixed", "x", "y", "z", "qw", "qx", "qy", "qz"]
    assert list(table[0]) == heads
    assert [line["block"] for line in table] == ["1", "2", "3", "4", "5"]
    for k, line in enumerate(table):
        assert [float(line[name]) for name in ("x", "y", "z")] == b.position[-1, k].tolist()
        turn = [float(line[name]) for name in ("qw", "qx", "qy", "qz")]
        assert turn == b.quaternion[-1, k].tolist()
        assert line["fixed"] == str(int(k < 3))


@pytest.mark.parametrize("kind", ["stl", "obj"])
def test_the_pile_is_closed_and_each_block_has_its_name(
    loose_pile: Run, tmp_path: Path, kind: str
) -> None:
    row = loose_pile.bodies.row(2.5)  # three are dropped
    path = exports.FORMATS[kind](loose_pile, row, tmp_path)
    mark = {"stl": "solid ", "obj": "o "}[kind]
    names = [line.split()[1] for line in path.read_text().splitlines() if line.startswith(mark)]
    assert names == [f"block-{k}" for k in range(1, 7)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = trimesh.load(path, force="mesh")
    mesh.merge_vertices()
    assert mesh.is_watertight and mesh.volume == pytest.approx(6 * 56e-6, rel=1e-5)
    points = np.concatenate([loose_pile.points(k, row) for k in range(6)])
    assert mesh.bounds == pytest.approx(np.array([points.min(axis=0), points.max(axis=0)]))


def parts_of(path: Path) -> tuple[dict, bytes]:
    content = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<I4s", content, 12)
    about, start = json.loads(content[20 : 20 + size]), 20 + size
    assert kind == b"JSON" and content[start + 4 : start + 8] == b"BIN\0"
    return about, content[start + 8 :]


def array_of(about: dict, numbers: bytes, number: int) -> np.ndarray:
    accessor = about["accessors"][number]
    view = about["bufferViews"][accessor["bufferView"]]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    found = np.frombuffer(numbers, "<f4", accessor["count"] * width, view["byteOffset"])
    return found.reshape(-1, width)


def test_the_film_moves_each_block(loose_pile: Run, tmp_path: Path) -> None:
    path = exports.to_glb(loose_pile, 0, tmp_path)
    about, numbers = parts_of(path)
    b, film = loose_pile.bodies, about["animations"][0]
    assert [node["name"] for node in about["nodes"]] == [f"block {k}" for k in range(1, 10)] + [
        "tank"
    ]
    found = {}
    for channel in film["channels"]:
        sampler = film["samplers"][channel["sampler"]]
        what = (channel["target"]["node"], channel["target"]["path"])
        found[what] = array_of(about, numbers, sampler["output"])
        times = array_of(about, numbers, sampler["input"])[:, 0]
    rows = np.searchsorted(b.time, times - 1e-6)
    assert times[0] == 0 and times[-1] == pytest.approx(b.time[-1])
    assert found[5, "translation"] == pytest.approx(b.position[rows, 5], abs=1e-7)
    assert found[5, "rotation"][:, 3] == pytest.approx(b.quaternion[rows, 5, 0], abs=1e-6)
    assert found[5, "rotation"][:, :3] == pytest.approx(b.quaternion[rows, 5, 1:], abs=1e-6)
    assert (found[5, "scale"][:, 0] > 0.5).tolist() == (times >= 2.0 - 1e-6).tolist()
    assert (0, "translation") not in found and (3, "scale") not in found


def test_other_programs_read_the_film(loose_pile: Run, tmp_path: Path) -> None:
    """As trimesh does: y is up there, and z runs to the viewer."""
    found = trimesh.load(exports.to_glb(loose_pile, 0, tmp_path))
    points = np.concatenate([loose_pile.points(k, 0) for k in range(9)])
    turned = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    wanted = np.array([turned.min(axis=0), turned.max(axis=0)])
    assert found.bounds == pytest.approx(wanted, abs=1e-6)


def test_a_film_keeps_the_coordinates_of_a_survey(tmp_path: Path) -> None:
    """Places count from a node at the corner of the tank: single precision holds them there."""
    corner = (354200.0, 5621080.0, -12.0)
    run = Run(write_run(tmp_path / "far", Motion(scale=100 / 3, origin=corner)))
    path = exports.to_glb(run, 0, tmp_path)
    assert parts_of(path)[0]["nodes"][-1]["translation"] == [354200.0, -12.0, -5621080.0]
    points = np.concatenate([run.points(k, 0) for k in range(9)])
    turned = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    wanted = np.array([turned.min(axis=0), turned.max(axis=0)])
    assert np.abs(trimesh.load(path).bounds - wanted).max() < 1e-5


@can_draw
def test_older_paraview_gets_blocks_and_fields(loose_pile: Run, tmp_path: Path) -> None:
    import pyvista as pv

    exports.to_pvd(loose_pile, 0, tmp_path)
    text = (tmp_path / "blocks.pvd").read_text()
    assert text.count("<DataSet") == len(loose_pile.field_times)
    frames = pv.PVDReader(tmp_path / "fields.pvd")
    assert frames.time_values == pytest.approx(loose_pile.field_times)
    image = pv.read(tmp_path / "fields-00004.vti")
    fields = loose_pile.fields_at(2.0)
    assert image.bounds == pytest.approx((0, 0.3, 0, 0.1, 0, 0.2))
    assert np.array_equal(image.cell_data["liquid"], fields.liquid.ravel())
    assert np.array_equal(image.cell_data["velocity"], fields.velocity.reshape(-1, 3))
    blocks = pv.read(tmp_path / "blocks-00004.vtp")
    assert set(blocks.cell_data["body"]) == {1, 2, 3, 4, 5, 6}
    assert blocks.volume == pytest.approx(6 * 56e-6, rel=1e-5)


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--to", "png"], "'png' is none of glb, stl, shapes, obj, csv, pvd"),
     (["--to", "stl", "--time", "99"], "the run goes from 0 to 8 s"),
     (["--to", "stl", "--final"], "--final is of csv")],
)  # fmt: skip
def test_wrong_wishes_are_one_line(loose_pile: Run, words: list[str], said: str, capsys) -> None:
    assert mics_tools(["export", str(loose_pile.folder), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_each_shape_has_its_file(loose_pile: Run, tmp_path: Path) -> None:
    folder = exports.to_shapes(loose_pile, 0, tmp_path)
    assert [path.stem for path in folder.iterdir()] == list(loose_pile.shapes)
    mesh = trimesh.load(folder / "hexapod.stl", force="mesh")
    mesh.merge_vertices()
    assert mesh.is_watertight and mesh.volume == pytest.approx(56e-6, rel=1e-5)
