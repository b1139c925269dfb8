"""Files that are none, pipes that nobody writes, control characters, threads beyond number."""

import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import pytest
import trimesh

from run_cases import ROOT
from shared_runs import call, program

MICS = ROOT / "mics"
CASE = """&run t_end = 0.01  dt = 5.0e-3 /
&grid cells = 8, 8, 8  length = 1, 1, 1 /
&fluid {fluid} /
{groups}
"""


def mics(work: Path, *words: str, **settings) -> subprocess.CompletedProcess[str]:
    """Run the program in a folder; it has ten seconds."""
    return program("--quiet", *words, cwd=work, timeout=10, **settings)


def case(fluid: str = "water_level = 0.5", groups: str = "") -> str:
    """A small tank."""
    return CASE.format(fluid=fluid, groups=groups)


def make(what: str, path: Path) -> str:
    """Something in the place of a file; its name."""
    if what == "device":
        return "/dev/zero"
    if what == "pipe":
        os.mkfifo(path)
    elif what == "folder":
        path.mkdir()
    return path.name


@pytest.mark.parametrize("what", ["pipe", "folder", "device"])
@pytest.mark.parametrize(
    ("variable", "text"),
    [
        ("&shape file", case(groups="&shape name = 'a'  kind = 'file'  file = '{odd}' /")),
        ("&bed file", case(groups="&bed file = '{odd}' /")),
        ("&bed file", case(groups="&bed file = '{odd}'  kind = 'stl' /")),
        ("&fluid initial_state", case(fluid="initial_state = '{odd}'")),
    ],
)
def test_named_in_a_case(variable: str, text: str, what: str, tmp_path: Path) -> None:
    """What a case names must be a file: code 2, at once, nothing written."""
    odd = make(what, tmp_path / "odd")
    (tmp_path / "case.nml").write_text(text.replace("{odd}", odd))
    done = mics(tmp_path, "case.nml")
    assert done.returncode == 2, done.stderr
    assert f"{variable} = '{odd}'" in done.stderr
    assert what != "pipe" or "is a pipe" in done.stderr
    assert not (tmp_path / "mics-out").exists()


@pytest.mark.parametrize("what", ["pipe", "folder", "nothing"])
@pytest.mark.parametrize("role", ["case", "restart"])
def test_named_in_the_command(role: str, what: str, tmp_path: Path) -> None:
    """The same for the case, code 2, and for the restart file, code 4."""
    (tmp_path / "case.nml").write_text(case())
    make(what, tmp_path / "odd")
    words = ["odd"] if role == "case" else ["--restart", "odd", "case.nml"]
    done = mics(tmp_path, *words)
    assert done.returncode == (2 if role == "case" else 4), done.stderr
    assert done.stderr.startswith("mics: odd: ") and (what != "pipe" or "is a pipe" in done.stderr)
    assert not (tmp_path / "mics-out").exists()


def test_pipe_in_the_place_of_the_lock(tmp_path: Path) -> None:
    (tmp_path / "case.nml").write_text(case())
    assert mics(tmp_path, "case.nml").returncode == 0
    os.mkfifo(tmp_path / "mics-out" / "run.lock")
    done = mics(tmp_path, "--restart", "mics-out/restart-a.h5", "case.nml")
    assert done.returncode == 4, done.stderr
    assert "run.lock: cannot open the file: it is a pipe" in done.stderr


def test_pipes_that_have_a_writer(tmp_path: Path) -> None:
    """A case may come through a pipe of the shell."""
    (tmp_path / "case.nml").write_text(case())
    for command in (
        "cat case.nml | {} --check",
        "{} --check < case.nml",
        "{} --check <(sleep 0.2; cat case.nml)",
    ):
        done = call("bash", "-c", command.format(MICS), cwd=tmp_path, timeout=10)
        assert done.returncode == 0, command


CONTROLS = ["\x1b[31mred\x07", "\x1b]0;a title\x07", "caf\u00e9 \u009b31m", "\x01", "\x7f"]


@pytest.mark.parametrize("bad", CONTROLS)
@pytest.mark.parametrize("role", ["title", "output", "bed", "name", "option", "case", "restart"])
def test_control_characters(role: str, bad: str, tmp_path: Path) -> None:
    """They are refused, and the terminal, which would obey them, never sees them."""
    text = case()
    if role in ("title", "output"):
        text = text.replace("&run ", f"&run {role} = '{bad}' ")
    elif role == "bed":
        text = case(groups=f"&bed file = '{bad}' /")
    elif role == "name":
        text = case(groups=f"&shape name = '{bad}'  kind = 'cube'  size = 0.1 /")
    (tmp_path / "case.nml").write_text(text)
    words = {"option": [f"--{bad}"], "case": [bad], "restart": ["--restart", bad, "case.nml"]}
    done = mics(tmp_path, *words.get(role, ["case.nml"]))
    assert done.returncode == 2, done.stderr
    said = done.stdout + done.stderr.replace("\n", "")
    assert done.stderr and said.isprintable(), said
    assert not (tmp_path / "mics-out").exists()


TETS = "mics-shape 1\npoints 4\n0 0 0\n.1 0 0\n0 .1 0\n0 0 .1\ntets 1\n1 2 3 4\n"
STL = trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="stl_ascii")


@pytest.mark.parametrize(
    ("group", "text"),
    [
        ("&shape name = 'a'  kind = 'file'  file = 'named' /", TETS),
        ("&bed file = 'named' /", "2 2 0 0 1 1\n.1 .1 .1 .1\n"),
        ("&bed file = 'named' /", "# a remark\n2 2 0 0 1 1\n.1 .1 .1 .1\n"),
        ("&bed file = 'named'  kind = 'stl' /", STL),
    ],
)
def test_byte_order_mark(group: str, text: str, tmp_path: Path) -> None:
    """The case and each file that it names may begin with one."""
    (tmp_path / "named").write_text("\ufeff" + text, encoding="utf-8")
    (tmp_path / "case.nml").write_text("\ufeff" + case(groups=group), encoding="utf-8")
    done = mics(tmp_path, "--check", "case.nml")
    assert done.returncode == 0, done.stderr


def test_letters_of_any_language(tmp_path: Path) -> None:
    (tmp_path / "case.nml").write_text(case().replace("&run", "&run title = 'Blöcke\t消波 ≤ 1'"))
    assert mics(tmp_path, "case.nml").returncode == 0


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_remarks_and_titles_of_any_encoding(encoding: str, tmp_path: Path) -> None:
    """Also blanks that do not break, by the program and by the tools, with the same result."""
    text = case().replace("&run t_end =", "! Blöcke 5\xa0mm, it's ä\n&run title = 'Bl\xf6cke\xa05'"
                          "  t_end\xa0=\xa0").replace(" /", "\xa0/")  # fmt: skip
    (tmp_path / "case.nml").write_bytes(text.encode(encoding))
    done = mics(tmp_path, "case.nml")
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "mics-out" / "run.h5") as file:
        assert "title = 'Bl\xf6cke\xa05'\n" in file["provenance"].attrs["parameters"]
    tools = {"PYTHONPATH": str(ROOT / "tools"), "PYTHONUTF8": "1"}
    plans = []
    for words in ([], ["--set", "run.t_end=0.01"]):
        command = (sys.executable, "-m", "micstools.cli", "check", "case.nml", *words)
        plan = call(*command, cwd=tmp_path, more=tools)
        assert plan.returncode == 0, plan.stderr
        plans.append(re.sub(" of .* that this machine has left", "", plan.stdout))
    assert plans[0] == plans[1]
    assert "Bl\xf6cke" in plans[0] and "Bl\xf6cke" in mics(tmp_path, "--check", "case.nml").stdout


@pytest.mark.parametrize(("given", "code"), [("2", 0), ("1024", 0), ("1025", 2), ("100000", 2)])
def test_threads_of_the_environment(given: str, code: int, tmp_path: Path) -> None:
    """OMP_NUM_THREADS has the bounds of --threads, which goes before it."""
    (tmp_path / "case.nml").write_text(case())
    for words, wanted in (([], code), (["--threads", "1"], 0)):
        done = call(MICS, "--check", *words, "case.nml", cwd=tmp_path, timeout=10,
                    more={"OMP_NUM_THREADS": given})  # fmt: skip
        assert done.returncode == wanted, done.stderr
        assert wanted == 0 or "OMP_NUM_THREADS = " in done.stderr


@pytest.mark.parametrize("name", [25 * ("d" * 200 + "/"), "x" * 5000])
def test_folder_of_a_name_too_long(name: str, tmp_path: Path) -> None:
    """It is refused at once, and no part of the way to it is made."""
    (tmp_path / "case.nml").write_text(case())
    done = mics(tmp_path, "--output", name, "case.nml")
    assert done.returncode == 2, done.stderr
    assert f"has {len(name)} characters, must have at most 4000" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["case.nml"]


@pytest.mark.parametrize("text", ["&{} /\n", "&{} 1 /\n", "&water {} = 1 /\n", "&water {} /\n"])
def test_names_without_end(text: str, tmp_path: Path) -> None:
    """A message shows the beginning of a name of a group or variable."""
    (tmp_path / "case.nml").write_text(case() + text.format("x" * 5000))
    done = mics(tmp_path, "case.nml")
    assert done.returncode == 2
    assert "xxx..." in done.stderr and max(map(len, done.stderr.splitlines())) < 300
