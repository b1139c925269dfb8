"""Good cases are accepted and bad ones refused: exit code, messages, and nothing written."""

import re
import resource
import subprocess
from pathlib import Path

import numpy as np
import pytest

from micstools.cases.initial_state import write_initial_state
from micstools.reading.reader import Run
from run_cases import CASES, ROOT, Machine, prepare
from shared_runs import call, texts

INPUT = sorted((ROOT / "input").glob("*.nml"))
GOOD = [*INPUT, *sorted(CASES.glob("*/*.nml"))]

SERIAL = Machine(ROOT / "mics")

TEXTS = texts("input")
TANK, FILES = TEXTS["tank"], TEXTS["files"]
BODY = "&body shape = 'cube'  position = "

UNKNOWN = "&run tend = 2: unknown variable, nearest known: t_end (line 1)"
MISSPELT = TANK.replace("t_end = 1", "t_end = 1 tend = 2")


def mics(
    arguments: list[str], folder: Path, text: str = "", machine: Machine = SERIAL
) -> subprocess.CompletedProcess[str]:
    """Run the program in a folder with the text as its standard input."""
    return call(*machine.command, *arguments, cwd=folder, input=text, timeout=60)


@pytest.mark.parametrize("case", GOOD, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_good_case_is_planned(case: Path, tmp_path: Path) -> None:
    """--check prints a plan, ends with 0 and writes nothing."""
    if (case.parent / "prepare.py").exists():
        prepare(case.parent.name, tmp_path)
    (tmp_path / "input").symlink_to(ROOT / "input")  # files are named from the folder above
    before = sorted(tmp_path.iterdir())
    done = mics(["--check", str(case)], tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    for heading in ("Run", "Tank", "Time steps", "Memory", "Files in"):
        assert f"\n{heading}" in f"\n{done.stdout}"
    assert sorted(tmp_path.iterdir()) == before


def test_a_set_up_goes_to_a_new_file(tmp_path: Path) -> None:
    """--plan writes where nothing is, with --check alone."""
    words = ["--check", "--plan", "plan.h5"]
    text = (ROOT / "input" / "blocks.nml").read_text()
    assert mics(words, tmp_path, text).returncode == 0
    before = (tmp_path / "plan.h5").read_bytes()
    done = mics(words, tmp_path, text)
    assert done.returncode == 2
    assert done.stderr == "mics: --plan = 'plan.h5': is there already, must be a new file\n"
    assert (tmp_path / "plan.h5").read_bytes() == before
    done = mics(words[1:], tmp_path, text)
    assert (done.returncode, done.stderr) == (2, "mics: --plan = 'plan.h5': goes with --check\n")
    done = mics([*words[:2], "no/plan.h5"], tmp_path, text)
    assert done.returncode == 4 and "no/plan.h5" in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["plan.h5"]


def test_plan_tells_the_numbers(tmp_path: Path) -> None:
    """The plan of the paper's tank: cells, tetrahedra, volume and weight of the block."""
    plan = mics(["--check"], tmp_path, (ROOT / "input" / "blocks.nml").read_text()).stdout
    assert "60 x 20 x 40 = 48000" in plan
    block = next(row for row in plan.splitlines() if row.split()[:2] == ["hexapod", "hexapod"])
    volume, mass, weight, submerged = map(float, block.split()[-4:])
    assert volume == pytest.approx(7 * 0.02**3, rel=1e-3)
    assert mass == pytest.approx(2300 * volume, rel=1e-3)
    assert weight == pytest.approx(9.81 * mass, rel=1e-3)
    assert submerged == pytest.approx((2300 - 998.2) * 9.81 * volume, rel=1e-3)


def write_named_files(folder: Path, height: float, size: float, liquid: float) -> None:
    """What FILES names."""
    folder.mkdir(exist_ok=True)
    (folder / "flat.txt").write_text("2 2 0 0 0.3 0.2\n" + 4 * f"{height}\n")
    corners = f"0 0 0\n{size} 0 0\n0 {size} 0\n0 0 {size}\n"
    (folder / "block.txt").write_text(f"mics-shape 1\npoints 4\n{corners}tets 1\n1 2 3 4\n")
    write_initial_state(folder / "state.h5", np.full((2, 2, 3), liquid))


def from_lines(plan: str) -> list[str]:
    """What a plan says of the files of FILES."""
    lines = [" ".join(line.split()) for line in plan.splitlines()]
    return [line for line in lines if line.startswith(("bed from", "a from", "initial state"))]


def test_files_are_looked_for_beside_the_case_first(tmp_path: Path) -> None:
    """Then in the working folder, which the plan says; standard input has no folder."""
    write_named_files(tmp_path / "sub", 0.01, 0.05, 1.0)
    write_named_files(tmp_path, 0.02, 0.06, 0.0)
    case = tmp_path / "sub" / "case.nml"
    case.write_text(FILES)
    beside, here = TEXTS["beside"], TEXTS["here"]
    for words, folder, text, wanted in (
        ([str(case)], tmp_path, "", beside),
        (["sub/case.nml"], tmp_path, "", beside),
        (["case.nml"], tmp_path / "sub", "", beside),
        ([], tmp_path, FILES, here),
        (["/dev/stdin"], tmp_path, FILES, here),
    ):
        done = mics(["--check", *words], folder, text)
        assert (done.returncode, done.stderr) == (0, "")
        assert from_lines(done.stdout) == wanted, words
    for words, text, share in (["sub/case.nml"], "", 1.0), ([], FILES, 0.0):
        done = mics([*words, "--quiet", "--output", f"out{share}"], tmp_path, text)
        assert (done.returncode, done.stderr) == (0, "")
        assert Run(tmp_path / f"out{share}").fields_at(0.0).liquid.max() == pytest.approx(share)
    for name in ("flat.txt", "block.txt", "state.h5"):
        (tmp_path / "sub" / name).unlink()
    done = mics(["--check", "sub/case.nml"], tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    there = " in the working folder, not beside the case"
    wanted = [re.sub(r"(from \S+?)(,|$)", rf"\1{there}\2", line) for line in here]
    assert from_lines(done.stdout) == wanted


def test_a_run_goes_on_with_the_files_beside_its_case(tmp_path: Path) -> None:
    """From another working folder, too; from standard input it is another case."""
    write_named_files(tmp_path / "sub", 0.01, 0.05, 1.0)
    write_named_files(tmp_path, 0.02, 0.06, 0.0)
    case, out = tmp_path / "sub" / "case.nml", tmp_path / "out"
    case.write_text(FILES)
    assert mics(["--quiet", "--output", str(out), "sub/case.nml"], tmp_path).returncode == 0
    case.write_text(FILES.replace("t_end = 1e-6", "t_end = 2e-6"))
    restart = ["--quiet", "--restart", str(out / "restart-a.h5")]
    done = mics(restart, tmp_path, case.read_text())
    assert done.returncode == 2 and "checksum of the bed" in done.stderr
    done = mics([*restart, "case.nml"], tmp_path / "sub")
    assert (done.returncode, done.stderr) == (0, "")


def test_bad_case_is_refused(tmp_path: Path) -> None:
    """Exit code 2, the message on standard error, nothing on standard output or disk."""
    for text, told in ((MISSPELT, f"mics: {UNKNOWN}\n"), ("", "the case is empty\n")):
        done = mics([], tmp_path, text)
        assert done.returncode == 2
        assert done.stderr.endswith(told) and len(done.stderr.splitlines()) == 1
        assert done.stdout == ""
        assert list(tmp_path.iterdir()) == []


def bodies_apart(count: int) -> str:
    """A dry tank with that many cubes in rows, none touching another."""
    row = 28
    places = [(i % row, i // row % row, i // row**2) for i in range(count)]
    lines = [BODY + ", ".join(f"{0.03 * (k + 1):.2f}" for k in place) + " /\n" for place in places]
    tank = TANK.replace("t_end = 1", "t_end = 1  physics = 'dry'")
    return tank.replace("0.3, 0.2, 0.2", "0.9, 0.9, 0.9") + "".join(lines)


LARGE = {
    "remarks": (lambda n: TANK + n * "! a remark\n", 900_000, "Memory"),
    "bodies": (bodies_apart, 20000, "free                    {count}"),
    "long title": (lambda n: TANK.replace("= 1 /", f"= 1  title = '{n * 'a'}' /"), 10**6, "Memory"),
    "groups": (
        lambda n: TANK + n * "&fluid /\n",
        100000,
        "&fluid: the group is given twice, first on line 4",
    ),
    "variables": (
        lambda n: TANK + "&fluid " + "".join(f"v{i} = 1\n" for i in range(n)) + "/",
        100000,
        "&fluid: more than 1000 variables in one group (line 1004)",
    ),
}


@pytest.mark.parametrize("name", LARGE)
def test_time_to_read_grows_with_length(name: str, tmp_path: Path) -> None:
    """A case four times as long takes some 4 times the time, not 16 times."""
    text, largest, expected = LARGE[name]

    def seconds(count: int) -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = mics(["--check"], tmp_path, text(count))
        assert expected.format(count=count) in done.stdout + done.stderr
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

    assert seconds(largest) < 8 * max(seconds(largest // 4), 0.05)
    assert "longer than 16 MiB" in mics(["--check"], tmp_path, "!" * (2**24 + 1)).stderr


def test_overlaps_are_counted_up_to_a_limit(tmp_path: Path) -> None:
    """Twenty pairs are named, the others counted, but not without end."""
    body = BODY + "0.1, 0.1, 0.1 /\n"
    errors = mics(["--check"], tmp_path, TANK + 50 * body).stderr.splitlines()
    assert len(errors) == 21
    assert errors[-1] == "mics: &body: at least 980 more pairs of bodies overlap"
    errors = mics(["--check"], tmp_path, TANK + 8 * body).stderr.splitlines()
    assert errors[-1] == "mics: &body: 8 more pairs of bodies overlap"


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"], ids=["unix", "windows", "old mac"])
def test_line_ends_and_byte_order_mark(ending: str, tmp_path: Path) -> None:
    """Text from any system reads the same, with or without a byte-order mark."""
    text = (TANK + "! größe\n&fluid water_level = high /\n").replace("\n", ending)
    case = tmp_path / "case.nml"
    case.write_bytes(b"\xef\xbb\xbf" + text.encode())
    done = mics(["--check", str(case)], tmp_path)
    assert "&fluid water_level = high: must be a number (line 5)" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.xdist_group("ranks")
def test_every_rank_stops_and_one_speaks(tmp_path: Path) -> None:
    """The parallel build prints each message once and ends with the same code; mpirun gives
    standard input to one process, which hands it on, or speaks for all."""
    machine, case = Machine(ROOT / "mics_mpi", ranks=2), tmp_path / "case.nml"
    case.write_text(MISSPELT)
    for words, text in ([str(case)], ""), ([], MISSPELT):
        done = mics(words, tmp_path, text, machine)
        assert done.returncode == 2
        assert done.stderr.count(UNKNOWN) == 1
    done = mics(["--check"], tmp_path, TANK, machine)
    assert (done.returncode, done.stderr) == (0, "")
    assert list(tmp_path.iterdir()) == [case]


@pytest.mark.parametrize("words", [["--check"], ["--version"], ["--help"]])
def test_a_full_standard_output_is_told(words: list[str]) -> None:
    """Nobody takes half a plan for a whole one."""
    case = TANK.encode() + b"&fluid water_level = 0.1 /\n"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(["mics", *words], input=case, stdout=full, stderr=subprocess.PIPE,
                              executable=ROOT / "mics")  # fmt: skip
    assert done.returncode == 4 and b"standard output cannot be written" in done.stderr
