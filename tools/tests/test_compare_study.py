"""Two runs beside each other, and a case on several grids: differences and orders are known."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calls import mics_tools, stand_in
from micstools.cases.convergence import converge
from micstools.commands import study
from micstools.commands.study import finer
from micstools.reading import comparison, units
from micstools.reading.reader import BadRun, Run
from micstools.shapes.geometry import quaternion_from_axis
from synthetic import UPRIGHT, Motion, change, reword, write_run

END = np.array([0.2, 0.05, 0.1])
TABLES = tomllib.loads(Path(__file__).with_name("study.toml").read_text())


def call(capsys, *words: str) -> tuple[int, str, str]:
    code, said = mics_tools(words), capsys.readouterr()
    return code, said.out, said.err


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Run, Run]:
    """One block, in the second run 3 mm to the side and turned by 20 degrees in the end, on twice
    the rows; its friction is another."""
    turned = quaternion_from_axis(np.array([0.0, 0, 1]), 20)
    still = Motion(places=[(END, UPRIGHT)], t_end=2.0, field_step=2.0)
    moved = replace(still, places=[(END + [0, 0.003, 0], turned)], history_step=0.01)
    one, two = write_run(tmp_path / "0", still), write_run(tmp_path / "1", moved)
    return Run(one), reword(two, lambda text: text + "&contact friction = 0.3 /\n")


def test_blocks_part(pair: tuple[Run, Run]) -> None:
    (found,) = comparison.blocks(*pair)
    assert found.block == 4
    assert found.distance == pytest.approx(0.003) and found.angle == pytest.approx(20.0)
    # It slides aside by 3 mm as s^2 (3 - 2 s), s = t / 0.8 s, and parts at 1 % of its diameter.
    run, radius = pair[0], pair[0].shapes["hexapod"].radius
    s = next(t for t in run.bodies.time if 0.003 * (t / 0.8) ** 2 * (3 - 2.5 * t) > 0.02 * radius)
    assert found.parted == pytest.approx(s)
    assert np.isnan(comparison.blocks(pair[0], pair[0])[0].parted)


def test_what_two_cases_differ_in(pair: tuple[Run, Run], capsys) -> None:
    assert comparison.parameters(*pair) == [("contact.friction", "-", "0.3")]
    assert comparison.same_bits(pair[0], pair[0]) and not comparison.same_bits(*pair)
    code, out, _ = call(capsys, "compare", *(str(run.folder) for run in pair))
    assert code == 0 and "contact.friction" in out and "bit by bit" not in out
    top = next(line for line in out.splitlines() if line.strip().startswith("top "))
    assert top.count(" mm") == 2 and "apart [mm]" in out and "cm2" in out
    assert out.splitlines()[-1].split()[2] == "3"  # mm
    code, out, _ = call(capsys, "compare", str(pair[0].folder), str(pair[0].folder))
    assert "bit by bit" in out and "no difference" in out and "never" in out
    change(pair[0].folder, "bodies/fluid_force", data=np.full_like(pair[0].bodies.position, np.nan))
    dry = Run(pair[0].folder)
    assert comparison.same_bits(dry, dry)


@pytest.mark.parametrize("order", [0.5, 1.0, 1.7, 4.0])
@pytest.mark.parametrize("grids", [(1, 2, 4), (1, 1.5, 2), (0.3, 1, 1.2, 2)])
def test_order_and_error_of_a_known_law(order: float, grids: tuple[float, ...]) -> None:
    values = [3.0 - 2.0 * n**-order for n in grids]
    found = converge(grids, values)
    assert found.order == pytest.approx(order) and found.limit == pytest.approx(3.0)
    assert found.error == pytest.approx(values[-1] - 3.0) and found.words == ""


@pytest.mark.parametrize(("words", "values"), TABLES["no_order"].items())
def test_what_does_not_converge_says_so(words: str, values: list[float]) -> None:
    found = converge((1, 2, 4), values)
    assert words in found.words and np.isnan(found.order)
    spread = np.ptp(values) if len(values) == 3 else np.nan
    assert found.range == pytest.approx(spread, nan_ok=True)


@pytest.mark.parametrize("words", TABLES["equal"])
def test_equal_numbers_are_converged(words: str) -> None:
    for values in TABLES["equal"][words]:
        found = converge((1, 2, 4, 8)[: len(values)], values)
        assert words in found.words and np.isnan(found.order), values
        assert (found.limit, found.error) == (values[-1], 0.0), values


def test_the_error_of_a_place_is_no_place() -> None:
    told = converge((1, 2, 4), [2 + 0.064 / n**2 for n in (1, 2, 4)])
    assert study._words(told, units.SITE.place) == "order 2.00, limit 2\u00a0m, error +0.004\u00a0m"


def test_cells_are_refined() -> None:
    text = "&grid cells = 10, 1, 21 length = 1, 1, 1 / ! a slice\n"
    found, fine = finer(text, 1.5)
    assert "cells = 15, 1, 32" in found and fine == pytest.approx((1.5 * 32 / 21) ** 0.5)
    for none in ("30", "'a'", "30, 'a', 4"):
        with pytest.raises(BadRun, match="no &grid cells = nx, ny, nz"):
            finer(f"&grid cells = {none} /\n", 2.0)


PROGRAM = """\
import numpy as np
from synthetic import UPRIGHT, Motion, change, write_run
from micstools.cases import settings
n = settings.value(text, "grid", "cells")[0]
places = [(np.array([0.2, 0.05, 0.08 + 0.4 / n**2]), UPRIGHT)]
write_run(folder, Motion(places=places, t_end=1.0, history_step=0.05, field_step=1.0,
                         cells=(12, 4, 8)))
code = 3 if n == BROKEN else 0
change(folder, "provenance", "exit_status", value=code)
print("ran", n)
sys.exit(code)
"""


def study_with(tmp_path: Path, broken: int = 0) -> list[str]:
    """The words of a study with a stand-in for the program, which ends with code 3 where there are
    so many cells."""
    case = tmp_path / "case.nml"
    check = 'sys.exit("mics: &grid cells: too many" if "9999" in sys.stdin.read() else 0)'
    path = stand_in(tmp_path / "mics", PROGRAM.replace("BROKEN", str(broken)), check)
    case.write_text("&run t_end = 1.0 /\n&grid cells = 10, 10, 10 length = 1, 1, 1 /\n")
    return ["study", str(case), "--program", str(path), "--out", str(tmp_path / "out")]


def test_a_study_finds_the_order(tmp_path: Path, capfd) -> None:
    words = study_with(tmp_path)
    code, out, _ = call(capfd, *words, "--cells", "1,1.5,2")
    assert code == 0 and out.count("\nran ") == 3
    assert " mm  order 2.00, limit 110 mm, error +1 mm" in out
    rows = {row["number"]: row for row in json.loads((tmp_path / "out/study.json").read_text())}
    assert rows["top"]["order"] == pytest.approx(2.0, abs=1e-6)
    assert rows["top"]["limit"] == pytest.approx(0.08 + 0.03)
    assert rows["top"]["error"] == pytest.approx(0.4 / 400)
    assert call(capfd, *words, "--cells", "1,1.5,2")[1].count("\nran ") == 0
    code, out, _ = call(capfd, *words, "--cells", "1,1.5,2,3")
    assert out.count("\nran 30") == 1
    for cells, why in (("1,999.9", "too many"), ("1,1.01", "the same cells")):
        code, _, err = call(capfd, *words, "--cells", cells)
        assert code == 2 and why in err


def test_a_grid_that_broke_down_is_left_out(tmp_path: Path, capfd) -> None:
    words = [*study_with(tmp_path, broken=15), "--cells", "1,1.5,2"]
    for runs in (3, 0):  # the second call makes none anew
        code, out, err = call(capfd, *words)
        assert code == 3 and out.count("\nran ") == runs
        assert "1.5/result ended with code 3" in err
    rows = json.loads((tmp_path / "out/study.json").read_text())
    assert "cells x 1.5" not in rows[0] and "cells x 2" in rows[0]
