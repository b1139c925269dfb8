"""An ensemble on a stand-in for the program: seeds, outcomes, second calls, the table."""

import csv
import fcntl
import json
import os
import signal
import socket
import ssl
import subprocess
import sys
import time
import tomllib
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

import h5py
import pytest

from calls import MICS, going_on, mics_tools, needs_mics, stand_in, until
from calls import program as file_to_call
from micstools.cases import settings
from micstools.ensembles import ensemble, ensemble_engine, ensemble_fields, slurm
from micstools.ensembles.ensemble import Plan
from micstools.reading import shares
from micstools.reading.reader import BadRun, Run
from synthetic import Motion, reword, write_run

CASE = """\
&run t_end = 1.0 /
&drop shape = 'a' position = 0,0,0 spread = 0.1, 0.1, 0.0 /
&drop shape = 'b' position = 0,0,0 /
"""
# The first seed finds no room, the second fails at its first try, others settle.
PROGRAM = """\
import h5py
first = not folder.exists()
if "seed = NO_ROOM" in text:
    code, time = 3, 1.0
    print("mics: 2 due block(s) never found room", file=sys.stderr)
elif "seed = FAILS" in text and first:
    code, time = 3, 0.2
    print("mics: the velocity is not a number", file=sys.stderr)
else:
    code, time = 0, 0.5
folder.mkdir(exist_ok=True)
with h5py.File(folder / "run.h5", "w") as h5:
    h5.create_group("provenance").attrs["exit_status"] = code
    h5["series/time"] = [0.0, time]
sys.exit(code)
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    first, second = (str(ensemble.seed_of(1, index)) for index in (0, 1))
    text = PROGRAM.replace("NO_ROOM", first).replace("FAILS", second)
    (tmp_path / "case.nml").write_text(CASE)
    check = 'print("  time of the run         about 1 s")'
    return stand_in(tmp_path / "a mics", text, check)


def call(program: Path, *words: str) -> int:
    case = str(program.parent / "case.nml")
    return mics_tools(["ensemble", case, "--program", str(program), *words])


def outcomes(folder: Path) -> list[str]:
    with (folder / "ensemble.csv").open() as file:
        return [row["outcome"] for row in csv.DictReader(file)]


def test_a_failed_run_is_named_and_run_again(tmp_path: Path, program: Path, capsys) -> None:
    one, two = tmp_path / "in one", tmp_path / "in two"
    assert call(program, "--runs", "3", "--jobs", "2", "--out", str(two)) == 3
    said = capsys.readouterr()
    assert "3 of them to do; each takes about 1 s; 2 at once" in said.out
    assert "run 0002 failed: mics: the velocity is not a number" in said.out
    assert "failed: 0002; the same command tries again" in said.err
    assert outcomes(two) == ["no room", "failed", "settled"]
    assert call(program, "--runs", "3", "--jobs", "2", "--out", str(two)) == 0
    assert "1 of them to do" in capsys.readouterr().out
    assert outcomes(two) == ["no room", "settled", "settled"]
    assert call(program, "--runs", "3", "--jobs", "1", "--out", str(one)) == 3
    assert call(program, "--runs", "3", "--jobs", "1", "--out", str(one)) == 0
    for name in ("ensemble.csv", "ensemble.json"):
        assert (one / name).read_bytes() == (two / name).read_bytes()


def test_other_runs_and_strange_folders_are_left_alone(
    tmp_path: Path, program: Path, capsys
) -> None:
    words = ("--runs", "2", "--slurm", "--out")
    folder = tmp_path / "a b"
    assert call(program, *words, str(folder)) == 0
    assert call(program, "--seed", "2", *words, str(folder)) == 2
    assert "another case, seed or setting" in capsys.readouterr().err
    assert call(program, *words, str(tmp_path)) == 2
    assert "is no ensemble" in capsys.readouterr().err
    with (folder / "ensemble.lock").open("a+") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        assert call(program, *words, str(folder)) == 2
    assert "is in use by process" in capsys.readouterr().err
    (tmp_path / "case.nml").write_text(CASE.replace("spread = 0.1, 0.1, 0.0", ""))
    assert call(program, "--tilt", "5", *words, str(tmp_path / "out")) == 0
    for value, code, said in (("0,4,0,6", 2, "a value stands twice"), ("0,4", 0, "2 values")):
        vary = ("--tilt", "5", "--vary", f"contact.friction={value}")
        assert call(program, *vary, *words, str(tmp_path / value)) == code
        assert said in capsys.readouterr().err


def test_an_ensemble_grows_without_changing_its_runs(tmp_path: Path) -> None:
    friction = ensemble.product([settings.parse_choices("contact.friction=0.4,0.6")])
    small, large = (
        list(ensemble.members(Plan(CASE, tmp_path, runs, 1, 0.005, 3.0, friction)))
        for runs in (2, 5)
    )
    assert large[:4] == small and len(large) == 10
    assert small[0].seed == small[1].seed != small[2].seed
    assert "friction = 0.4" in small[0].text and "friction = 0.6" in small[1].text
    assert small[0].text.count("spread = 0.005, 0.005, 0.0") == 2
    assert f"seed = {ensemble.seed_of(1, 0, 1)}" in small[0].text  # drops differ from each other
    assert "stop_when_settled = .true." in small[0].text


CHANCE = tomllib.loads(Path(__file__).with_name("chance.toml").read_text())


@pytest.mark.parametrize(
    ("random", "drop"), [(k == "random", d) for k in CHANCE for d in CHANCE[k]]
)
def test_what_is_left_to_chance(random: bool, drop: str, tmp_path: Path) -> None:
    plan = tmp_path / "plan.csv"
    plan.write_text("shape,x,y,z,time\nrock-07,0,0,0,0\nrock,1,0,0,0\n")
    shapes = "&shape name='a' kind='cube' /\n&shape name = 'rock' kind = 'rock' /\n"
    assert ensemble.is_random(f"{shapes}&drop {drop.replace('PLAN', str(plan))} /") == random
    plan.write_text(plan.read_text().replace("rock,", "rock-08,"))
    assert not ensemble.is_random(f"{shapes}&drop file = '{plan}' /")


def test_loads_are_pooled(tmp_path: Path, program: Path, capsys) -> None:
    """Plans and runs of an ensemble, one each, in place of the plan of the case."""
    case, plans, fills = (program.parent / name for name in ("case.nml", "a.csv", "fills"))
    case.write_text("&run t_end = 1.0 /\n&drop file = 'own.csv' /\n")
    plans.write_text("shape,x,y,z,time\n")
    rows = [{"run": n, "outcome": how, "folder": f"{n:04d}"}
            for n, how in enumerate(("settled", "failed", "settled"), 1)]  # fmt: skip
    fills.mkdir()
    (fills / "ensemble.json").write_text(json.dumps({"format": "mics-ensemble", "table": rows}))
    out = tmp_path / "out"
    words = ("--start", str(plans), str(fills), "--slurm", "--out", str(out))
    assert call(program, *words) == 0
    said = capsys.readouterr()
    assert "3 runs in" in said.out and "left out 1 of 3 runs: 2 (failed)" in said.err
    texts = [(out / f"{n:04d}/case.nml").read_text() for n in (1, 2, 3)]
    assert [settings.value(text, "drop", "file") for text in texts] == [str(plans), None, None]
    runs = [str(fills / f"{n:04d}/result/run.h5") for n in (1, 3)]
    assert [settings.value(text, "start", "file") for text in texts] == [None, *runs]
    with (out / "ensemble.csv").open() as file:
        assert [row["start"] for row in csv.DictReader(file)] == [str(plans), *runs]
    assert call(program, "--runs", "4", *words) == 2  # the fourth would be the first again
    assert "nothing is left to chance" in capsys.readouterr().err


# Piles are the higher the larger the seed; fields are written where they are to.
PILES = """\
import re
from synthetic import UPRIGHT, Motion, write_run
seed = int(re.search(r"seed = (\\d+)", text)[1])
place = [([0.15, 0.05, 0.08 + 1e-11 * seed], UPRIGHT)]
write_run(folder, Motion(t_end=1.0, history_step=0.5, cells=(6, 2, 4), places=place))
if "field_interval = 0.0" in text:
    (folder / "fields.vtkhdf").unlink()
"""


@pytest.fixture
def piles(tmp_path: Path) -> Path:
    (tmp_path / "case.nml").write_text(CASE)
    return stand_in(tmp_path / "mics", PILES)


def with_fields(folder: Path) -> list[str]:
    return sorted(str(p.parent.relative_to(folder)) for p in folder.rglob("fields.vtkhdf"))


def test_the_median_run_keeps_its_fields(tmp_path: Path, piles: Path, capsys) -> None:
    seeds = [ensemble.seed_of(1, index) for index in range(4)]
    median = seeds.index(sorted(seeds)[1]) + 1  # the lower of the two in the middle
    out, again = tmp_path / "out", ("--runs", "4", "--jobs", "2", "--keep-fields")
    assert call(piles, *again, "median", "--out", str(out)) == 0
    said = capsys.readouterr().out
    assert f"with fields: {median:04d}, 1 of them to do" in said
    assert said.splitlines()[-1] == f"{out}/{median:04d}/fields/result"
    assert with_fields(out) == [f"{median:04d}/fields/result"]
    plain, full = (Run(out / f"{median:04d}" / name) for name in ("result", "fields/result"))
    assert plain.bodies.position == pytest.approx(full.bodies.position, abs=0)
    table = (out / "ensemble.csv").read_bytes()
    assert call(piles, *again, "median", "--out", str(out)) == 0
    assert f"with fields: {median:04d}, 0 of them to do" in capsys.readouterr().out
    assert call(piles, *again, "1,3", "--out", str(out)) == 0
    assert set(with_fields(out)) == {f"{n:04d}/fields/result" for n in {median, 1, 3}}
    assert (out / "ensemble.csv").read_bytes() == table


def test_each_choice_has_its_median(tmp_path: Path, piles: Path) -> None:
    seeds = [ensemble.seed_of(1, index) for index in range(3)]
    middle = 2 * seeds.index(sorted(seeds)[1])
    words = ("--runs", "3", "--vary", "contact.friction=0.4,0.6", "--keep-fields", "median")
    assert call(piles, *words, "--out", str(tmp_path / "out")) == 0
    names = [f"{middle + k:04d}/fields/result" for k in (1, 2)]
    assert with_fields(tmp_path / "out") == names


def test_no_complete_pile_has_no_median(tmp_path: Path) -> None:
    """The second block is still to come when the run ends."""
    (member,) = ensemble.members(Plan(CASE, tmp_path, 1, 1))
    write_run(member.result, Motion(t_end=0.5, cells=(6, 2, 4)))
    with pytest.raises(BadRun, match="no run ended with a complete pile"):
        ensemble_fields.medians({member: ensemble.State("time over")})


def test_a_door_is_no_part_of_a_pile(tmp_path: Path) -> None:
    """A body that a table moves, above the pile, does not count as its top."""
    folder = write_run(tmp_path, Motion(cells=(6, 2, 4)))
    top = ensemble_fields.top_of_pile(Run(folder))
    with h5py.File(folder / "run.h5", "r+") as h5:
        h5["bodies/position"][:, 0, 2] = 0.18
    assert ensemble_fields.top_of_pile(Run(folder)) > top + 0.02
    moved = "fixed = .true. motion = 'door.csv'"
    run = reword(folder, lambda text: text.replace("fixed = .true.", moved, 1))
    assert ensemble_fields.top_of_pile(run) == pytest.approx(top)


def test_interval_of_a_share() -> None:
    """Newcombe, Two-sided confidence intervals for the single proportion (1998), table I."""
    assert shares.wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert shares.wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=5e-5)
    assert shares.wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert shares.wilson(1, 29) == pytest.approx((0.0061, 0.1718), abs=5e-5)
    assert shares.wilson(0, 0) == (0.0, 1.0)


def test_the_slurm_script_is_a_script(tmp_path: Path) -> None:
    folder = tmp_path / "a b" / "0004"
    (folder / "result").mkdir(parents=True)
    text = slurm.script(folder.parent, [1, 4], Path("/bin/echo"), ["time=1:00:00"])
    assert "#SBATCH --array=1,4\n" in text and "#SBATCH --time=1:00:00\n" in text
    text = text.replace("cd ", "SLURM_ARRAY_TASK_ID=4; cd ", 1)
    done = subprocess.run(["sh"], input=text, capture_output=True, text=True)
    assert done.stdout == f"--quiet --output {folder}/result {folder}/case.nml\n"


BLOCKS = """\
&run t_end = 30.0  physics = 'dry'  restart_interval = 0.5 /
&grid cells = 30, 10, 20  length = 0.3, 0.1, 0.2 /
&shape name = 'cube' kind = 'cube' size = 0.02 /
&drop shape = 'cube' position = 0.15, 0.05, 0.1 count = 8 spread = 0.02, 0.02, 0.0 /
"""


def ensemble_words(case: str, folder: Path, runs: int, jobs: int) -> list[str]:
    return [sys.executable, "-m", "micstools.cli", "ensemble", str(folder.parent / case),
            "--runs", str(runs), "--jobs", str(jobs), "--out", str(folder)]  # fmt: skip


def begun(*words: str) -> AbstractContextManager[subprocess.Popen[str]]:
    return going_on(*words, stderr=subprocess.PIPE, text=True, preexec_fn=ctrl_c_counts)


def press_ctrl_c(running: subprocess.Popen[str]) -> str:
    """What a command says in the end."""
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 130
    return said


def ctrl_c_counts() -> None:
    """Also where whoever runs the tests had switched it off, as `sh` does for what ends in &."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@needs_mics
@pytest.mark.cost(30)
def test_the_table_is_the_same_after_ctrl_c_and_with_any_jobs(tmp_path: Path) -> None:
    """With the program itself: runs stopped on their way, then gone on with, against runs that
    were left alone, one after the other."""
    (tmp_path / "blocks.nml").write_text(BLOCKS)
    stopped, whole = tmp_path / "stopped", tmp_path / "whole"
    with begun(*ensemble_words("blocks.nml", stopped, 3, 2)) as running:
        until(lambda: len(list(stopped.glob("*/result/restart-*.h5"))) >= 2)
        assert "stopped; the same command goes on" in press_ctrl_c(running)
    assert set(outcomes(stopped)) <= {"interrupted", "missing", "settled"}
    assert "interrupted" in outcomes(stopped)
    assert subprocess.run(ensemble_words("blocks.nml", stopped, 3, 2)).returncode == 0
    again = [*ensemble_words("blocks.nml", whole, 3, 1), "--program", MICS]
    assert subprocess.run(again).returncode == 0
    assert outcomes(whole) == ["settled"] * 3
    for name in ("ensemble.csv", "ensemble.json"):
        assert (stopped / name).read_bytes() == (whole / name).read_bytes()
    for number in ("0001", "0002", "0003"):
        one, two = (Run(folder / number / "result").bodies for folder in (stopped, whole))
        assert (one.time == two.time).all() and (one.position == two.position).all()


def test_ctrl_c_in_python_waits_for_the_restart_file(tmp_path: Path) -> None:
    """It takes a second; `subprocess.run` gives the program a quarter of it."""
    file_to_call(tmp_path / "slow", "#!/bin/sh\ntrap 'sleep 1; touch written; exit 130' INT\n"
                 "cat > began\nwhile :; do sleep 0.1; done\n")  # fmt: skip
    (tmp_path / "case.nml").write_text(CASE)
    words = "from micstools import Case; Case.read('case.nml').run('out', mics='./slow')"
    with going_on(sys.executable, "-c", words, cwd=tmp_path, start_new_session=True,
                  stderr=subprocess.PIPE, preexec_fn=ctrl_c_counts) as running:  # fmt: skip
        until(lambda: (tmp_path / "began").exists() and (tmp_path / "began").read_text())
        os.killpg(running.pid, signal.SIGINT)
        assert b"KeyboardInterrupt" in running.communicate(timeout=60)[1]
    assert (tmp_path / "written").exists()


@pytest.fixture
def queue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The commands of two systems of queues."""
    folder = tmp_path / "queue"
    for names, script in ((("sbatch", "qsub"), "submit"), (("scancel", "qdel"), "cancel")):
        for name in names:
            text = Path(__file__).with_name(f"queue_{script}.sh").read_text()
            file_to_call(folder / name, text)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    return folder


@pytest.mark.cost(10)
@pytest.mark.parametrize("system", ["slurm", "pbs"])
def test_a_queue_gives_the_same_table(
    tmp_path: Path, program: Path, queue: Path, system: str, capfd
) -> None:
    words = ("--runs", "3", "--jobs", "2", "--seed", "3", "--out")
    asked = ("--cluster", system, "walltime=1:00:00", "queue=short")
    assert call(program, *words, str(tmp_path / "queued"), *asked) == 0
    assert call(program, *words, str(tmp_path / "here")) == 0
    for name in ("ensemble.csv", "ensemble.json"):
        assert (tmp_path / "queued" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()
    job = next(queue.glob("job.*")).read_text()
    assert {"slurm": "#SBATCH -t 1:00:00\n", "pbs": "#PBS -l walltime=1:00:00\n"}[system] in job
    assert {"slurm": "#SBATCH -p short\n", "pbs": "#PBS -q short\n"}[system] in job
    assert "Traceback" not in capfd.readouterr().err


@contextmanager
def slow_runs(program: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """An ensemble whose first run has begun and takes long."""
    slow = program.read_text().replace("import h5py", "import time; time.sleep(50)\nimport h5py")
    program.write_text(slow)
    out = program.parent / "out"
    call = [*ensemble_words("case.nml", out, 2, 1), "--program", str(program), *words]
    with begun(*call) as running:
        until((out / "0001" / "log.txt").exists)
        time.sleep(0.5)
        yield running
        if running.poll() is None:
            press_ctrl_c(running)


def listeners(said: Path) -> set[tuple[str, int]]:
    """Where those processes listen whose command line or environment has a path."""
    import psutil

    found = set()
    for process in psutil.process_iter():
        with suppress(psutil.Error):  # it has ended
            words = [*process.cmdline(), *process.environ().values()]
            if any(str(said) in word for word in words):
                links = process.net_connections("inet")
                found |= {tuple(link.laddr) for link in links if link.status == psutil.CONN_LISTEN}
    return found


def asks_for_a_certificate(address: tuple[str, int]) -> bool:
    """Does it talk TLS, and only to who has the key?"""
    stranger = ssl.create_default_context()
    stranger.check_hostname, stranger.verify_mode = False, ssl.CERT_NONE
    with socket.create_connection(address, 10) as link:
        try:
            stranger.wrap_socket(link).read()
        except ssl.SSLError as refused:
            return "CERTIFICATE_REQUIRED" in str(refused)
    return False


def test_runs_on_this_machine_listen_nowhere(tmp_path: Path, program: Path) -> None:
    with slow_runs(program):
        assert listeners(tmp_path) == set()


@pytest.mark.cost(10)
def test_a_queue_lets_nobody_in_and_ctrl_c_reaches_its_runs(
    tmp_path: Path, program: Path, queue: Path
) -> None:
    """Scheduler and worker want a certificate; its key lies in private files, no page is open."""
    with slow_runs(program, "--cluster", "slurm") as running:
        found = listeners(tmp_path)
        outside = {place for place in found if place[0] != "127.0.0.1"}
        assert len({port for _, port in outside}) == 2  # of scheduler and worker
        assert all(asks_for_a_certificate(place) for place in outside)
        for _, port in found - outside:
            for path in ("/", "/status", "/info/main/workers.html", "/json/identity.json"):
                with pytest.raises(urllib.error.HTTPError, match="404"):
                    urllib.request.urlopen(f"http://127.0.0.1:{port}{path}")
        keys = list((tmp_path / "out" / "jobs").glob(".*key*"))
        assert keys and all(path.stat().st_mode & 0o777 == 0o600 for path in keys)
        said = press_ctrl_c(running)
    assert said.splitlines()[-1] == "stopped; the same command goes on where each run stood"
    assert "Traceback" not in said
    assert "KeyboardInterrupt" in (tmp_path / "out" / "0001" / "log.txt").read_text()
    assert not list((tmp_path / "out" / "jobs").glob(".*key*"))


def test_a_queue_that_takes_no_job_or_is_not_here_is_one_line(
    tmp_path: Path, program: Path, queue: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    words = ("--runs", "2", "--jobs", "2", "--out", str(tmp_path / "out"), "--cluster")
    (queue / "full").touch()
    for system, said in (
        (["slurm"], " slurm: sbatch takes no job: the queue is full"),
        (["pbs", "memory=much"], " pbs: Could not interpret 'much' as a byte unit"),
        (["pbs", "--slurm"], " runs, --slurm only writes a script: give one"),
    ):
        assert call(program, *words, *system) == 2
        assert capsys.readouterr().err == f"mics-tools ensemble: --cluster{said}\n"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert call(program, *words, "slurm") == 2
    assert "there is no sbatch on this machine" in capsys.readouterr().err


def test_another_file_of_the_same_name_is_refused(tmp_path: Path, program: Path, capsys) -> None:
    """Runs with an old and a new block must not be one ensemble."""
    block = tmp_path / "block.txt"
    block.write_text("mics-shape 1")
    (tmp_path / "case.nml").write_text(CASE + f"&shape name = 'a' kind = 'file' file = '{block}' /")
    words = ("--runs", "2", "--slurm", "--out", str(tmp_path / "a b"))
    assert call(program, *words) == 0
    assert call(program, *words) == 0
    block.write_text("mics-shape 1 of another size")
    assert call(program, *words) == 2
    assert f"{block} has changed since" in capsys.readouterr().err


def test_a_file_beside_the_case_is_found_from_its_copies(
    tmp_path: Path, program: Path, monkeypatch
) -> None:
    """The copies name it from where we are; one that lies there alone keeps its name."""
    monkeypatch.chdir(tmp_path)
    Path("study").mkdir()
    Path("study/block.txt").write_text("beside the case")
    for name in ("block.txt", "mound.txt"):
        Path(name).write_text("elsewhere")
    case = Path("study/case.nml")
    more = "&shape name = 'a' kind = 'file' file = 'block.txt' /\n&bed file = 'mound.txt' /\n"
    case.write_text(CASE + more)
    words = ("ensemble", str(case), "--program", str(program), "--runs", "1", "--slurm")
    assert mics_tools([*words, "--out", "out"]) == 0
    copy = Path("out/0001/case.nml").read_text()
    assert settings.value(copy, "shape", "file") == "study/block.txt"
    assert settings.value(copy, "bed", "file") == "mound.txt"
    sums = json.loads(Path("out/0001/files.json").read_text())
    assert set(sums) == {"study/block.txt", "mound.txt"}


@pytest.mark.parametrize(
    ("said", "code", "calls"),
    [("restart-b.h5: damaged; a run cannot go on from it", 4, "b a new "),
     ("run.h5: has lost rows, the run cannot go on in it", 4, "b a new "),
     ("fields.vtkhdf: cannot write: No space left on device", 4, "b "),
     ("the case differs from that of the restart file", 2, "b a new ")],
)  # fmt: skip
def test_only_a_bad_restart_file_throws_a_run_back(
    said: str, code: int, calls: str, tmp_path: Path
) -> None:
    """A disk that is full after hours is no reason to begin anew."""
    program = file_to_call(
        tmp_path / "mics",
        f"#!{sys.executable}\nimport sys\nwords = sys.argv[1:]\n"
        f"open({str(tmp_path / 'calls')!r}, 'a').write("
        "words[words.index('--restart') + 1][-4] + ' ' if '--restart' in words else 'new ')\n"
        f"print({said!r}, file=sys.stderr)\nsys.exit({code})\n",
    )
    member = ensemble.Member(1, 1, (), CASE, tmp_path / "0001")
    member.result.mkdir(parents=True)
    for age, name in enumerate(("restart-b.h5", "restart-a.h5")):
        (member.result / name).touch()
        os.utime(member.result / name, (1000 - age, 1000 - age))
    assert ensemble_engine.execute(member, program, tmp_path) == code
    assert (tmp_path / "calls").read_text() == calls
