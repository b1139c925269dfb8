"""What is handed over: options that are given once, planned beside built, the page on paper; how a
roundhead is made."""

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.quiver import Quiver

from calls import ROOT, mics_tools, python
from micstools.piles import drawing, options
from micstools.piles.handover import Handover
from micstools.piles.options import Options
from micstools.reading.reader import Run
from micstools.shapes import height_maps, stones
from micstools.shapes.height_maps import HeightMap
from synthetic import reword, with_bed, write_run
from test_pile_ensemble import cube_run
from test_places import EDGE, cubes, write


def told_by(words: list[str], capsys) -> str:
    """What a command says, its printed and its page's blanks alike."""
    assert mics_tools(words) == 0
    return capsys.readouterr().out.replace("\u00a0", " ")


def test_options_are_given_once(tmp_path: Path, capsys) -> None:
    """places, pile and the page tell the same of a run, whichever was told."""
    folder = str(write(tmp_path / "run").folder)
    said = told_by(
        ["places", folder, "--tolerance", "0.11", "--layers", "2", "--north", "20"], capsys
    )
    within, layer = said.splitlines()[1:2], re.findall("layer coefficient of 2 layers [^;]*", said)
    assert within[0].startswith("2 of 4 ") and "within 110 mm of their place" in within[0] and layer
    for command in ("pile", "report"):
        found = told_by([command, folder], capsys)
        page = Path(folder) / "report.html"
        found += page.read_text().replace("\u00a0", " ") if command == "report" else ""
        assert all(words in found for words in (*within, *layer)), command
    places, pile = (
        json.loads((Path(folder) / name).read_text()) for name in ("places.json", "pile.json")
    )
    assert places["layer"] == pile["layer"] and places["within"] == pile["within"]
    assert pile["coefficient_ball"] == pile["layer"]["ball"]["coefficient"]
    assert options.told(Path(folder)) == Options(north=20.0, tolerance=0.11, layers=2)
    assert told_by(["pile", folder, "--layers", "1"], capsys).count("coefficient of 1 layer") == 1


def test_what_is_refused_is_not_kept(tmp_path: Path, capsys) -> None:
    run = write(tmp_path / "run")
    for words, why in (
        (["pile", "--area", "0", "0", "1", "1"], "the tank reaches from"),
        (["places", "--to", "asc", "--north", "20"], "has its rows along east"),
        (["report", "--crs", "here"], "must be as EPSG:25832"),
        (["report", "--section", "9", "9", "9", "9"], "--section 9 9 9 9: misses the units"),
    ):
        assert mics_tools([words[0], str(run.folder), *words[1:]]) == 2
        assert why in capsys.readouterr().err
    assert not (run.folder / options.FILE).exists()
    for text in ('{"tolerance": ', '{"colour": 1}', "[]"):
        (run.folder / options.FILE).write_text(text)
        assert mics_tools(["places", str(run.folder)]) == 2
        assert "handover.json: holds no options" in capsys.readouterr().err


def test_without_a_plan_there_is_no_talk_of_one(tmp_path: Path, capsys) -> None:
    """Units without names that nobody sets down."""
    run = Run(write_run(tmp_path / "run", cube_run([(0.04, 0.05, 0.01)])))
    for command in ("places", "pile", "report"):
        assert "in the plan" not in told_by([command, str(run.folder)], capsys)
    page = (run.folder / "report.html").read_text()
    assert "deviation [" not in page and "place in the plan" not in page.split("<details>")[0]
    lowered = "&drop shape = 'cube'  position = 0.1, 0.1, 0.1  lowering_speed = 1.0 /\n"
    run = reword(run.folder, lambda text: text + lowered)
    assert "in the plan" in told_by(["places", str(run.folder)], capsys)


def test_the_plan_shows_what_is_off(tmp_path: Path, capsys) -> None:
    """Both cubes of one place are farther off than 11 mm, one of them than 11 cm; by names."""
    folder = write(tmp_path / "run").folder
    assert mics_tools(["places", str(folder), "--to", "svg,pdf", "--tolerance", "0.11"]) == 0
    for name in ("places", "places-section"):
        assert "<svg" in (folder / f"{name}.svg").read_text()
        assert (folder / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    given = Handover(Run(folder), options.told(folder))
    figure = drawing.plan(given)
    axes = figure.axes[0]
    assert {text.get_text() for text in axes.texts} >= {"A1", "A2", "B 1", "B2", "N"}
    colours = next(c for c in axes.collections if len(c.get_facecolors()) == 7).get_facecolors()[
        :, :3
    ]
    assert len(np.unique(colours[3:7], axis=0)) == 2 and len(np.unique(colours[:3], axis=0)) == 1
    assert drawing.drawn(figure, "svg") == drawing.drawn(drawing.plan(given), "svg")
    arrows = next(c for c in axes.collections if isinstance(c, Quiver))
    assert arrows.U[0] == pytest.approx(-0.12)
    assert mics_tools(["report", str(folder), "--tolerance", "0.01"]) == 0
    row = (folder / "report.html").read_text().split(">4 A1<")[1].split("</tr>")[0]
    assert re.findall(r">([-\d.]+)<", row)[:4] == ["121.7", "-120.0", "-20.0", "-150.0"]


def test_a_section_is_exact(tmp_path: Path) -> None:
    """Of a cube the cut through its middle is a square; down a slope of 1:4 the design surface of
    one layer stands k_t D_n sqrt(1 + 1/16) above it."""
    run = cubes(tmp_path, [(0.15, 0.05, 0.08)])
    body = Handover(run, Options()).bodies[3]
    for degrees in (0.0, 30.0):
        along = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
        cut = drawing._cut(body, np.array([0.15, 0.05]), along)
        length = np.linalg.norm(cut[:, 1] - cut[:, 0], axis=1).sum()
        assert length == pytest.approx(2 * EDGE * (1 + 1 / max(along)))
    with_bed(run.folder, lambda x, y: 0.1 - x / 4)
    cube = "&shape name = 'cube'  kind = 'cube' /\n"
    given = Handover(reword(run.folder, lambda text: text + cube), Options(layers=1))
    assert given.measured
    start, end = drawing._line(given, given.measured[0])
    assert (end - start)[1] == pytest.approx(0.0, abs=1e-9) and end[0] > start[0]
    s = np.linspace(0, 1, 9)
    found = drawing._design(given, given.measured[1], s, -s / 4)
    assert found == pytest.approx(1.10 * EDGE * math.sqrt(1 + 1 / 16))
    chosen = Handover(given.run, Options(section=[0.1, 0.02, 0.2, 0.03]))
    assert drawing._line(chosen, given.measured[0])[1].tolist() == [0.2, 0.03]


def test_a_page_on_paper(tmp_path: Path) -> None:
    pytest.importorskip("weasyprint")
    folder = write(tmp_path / "run").folder
    assert mics_tools(["report", str(folder), "--pdf"]) == 0
    assert (folder / "report.pdf").read_bytes().startswith(b"%PDF")
    assert (folder / "report.pdf").stat().st_size > 30_000


def test_stones_lie_half_sunk() -> None:
    """A ball on a slope has its height over its middle; many raise a plane by what half ellipsoids
    of their number hold at most, the same for a seed."""
    slope = HeightMap((0.0, 0.0), (0.05, 0.05), np.tile(np.arange(41) * 0.025, (41, 1)))
    z = slope.z.copy()
    stones._raise(z, slope, np.array([1.0, 1.0]), np.eye(3) / 0.3**2, 0.3)
    x, y = np.meshgrid(np.arange(41) * 0.05 - 1, np.arange(41) * 0.05 - 1)
    rest = 0.3**2 - x**2 - y**2
    ball = np.where(rest > 0, 0.5 + np.sqrt(np.maximum(rest, 0)), -1)
    assert z == pytest.approx(np.maximum(slope.z, ball))
    flat = HeightMap((5.0, 7.0), (1.0, 1.0), np.full((31, 41), 2.0))
    found = stones.lay(flat, 0.8, 3)
    assert found.spacing == (0.2, 0.2) and found.last == pytest.approx(flat.last)
    raised = found.z - 2.0
    assert raised.min() == 0 and 0.4 < raised.max() < 0.4 * 1.2 * 1.5**2
    most = 2 / 3 * math.pi * 0.4**3 * math.exp(4.5 * stones._GRADING**2) / (stones.PITCH * 0.8) ** 2
    assert 0.7 * most < raised.mean() < most
    assert (stones.lay(flat, 0.8, 3).z == found.z).all() and (
        stones.lay(flat, 0.8, 4).z != found.z
    ).any()


def test_the_roundhead_is_made_by_its_script(tmp_path: Path, capsys) -> None:
    """Survey, plan and bed of input/ to the byte; the plan stands on the core, units apart."""
    python(ROOT / "tools" / "make_roundhead.py", tmp_path, check=True)
    bed = tmp_path / "roundhead-bed.txt"
    words = ["bed", str(tmp_path / "roundhead.asc"), "--stones", "0.8", "--out", str(bed)]
    assert mics_tools(words) == 0
    for path in tmp_path.glob("roundhead*"):
        assert path.read_bytes() == (ROOT / "input" / path.name).read_bytes(), path.name
    units = list(csv.DictReader((tmp_path / "roundhead.csv").open()))
    assert len(units) == 40 == len({unit["name"] for unit in units})
    place = np.array([[float(unit["x"]), float(unit["y"])] for unit in units])
    apart = np.linalg.norm(place[:, None] - place, axis=2)[~np.eye(40, dtype=bool)]
    assert apart.min() > 1.6
    core = height_maps.load(tmp_path / "roundhead.asc")
    column, row = np.round(place - core.first).astype(int).T
    assert (core.z[row, column] < 0).all()  # under water
