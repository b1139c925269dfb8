"""Scripts find the results of a folder or case file, and name in one line what is wrong."""

import subprocess
import sys
from pathlib import Path

import h5py
import pytest

from calls import ROOT, python
from micstools import command
from micstools.reading.reader import BadRun, Run
from synthetic import Motion, write_run

CASE = "&run t_end = 1.0 {0} /\n&grid cells = 1, 1, 1 length = 1.0, 1.0, 1.0 /\n"
OF_RUNS = ("plot_pile", "plot_history", "plot_shape", "check_pile")


def call(script: str, *words: str | Path, **more) -> subprocess.CompletedProcess[str]:
    return python(ROOT / "tools" / f"{script}.py", *words, **more)


def one_line(done: subprocess.CompletedProcess[str]) -> str:
    """What a script said that refused its arguments in good order."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    return line


def test_the_results_of_a_case_are_in_the_folder_it_names(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("named.nml").write_text(CASE.format("output = 'here/results'"))
    Path("silent.nml").write_text(CASE.format(""))
    with pytest.raises(BadRun, match="here/results, the output of named.nml.*run the case first"):
        command.results_of(Path("named.nml"))
    for name in ("here/results", "mics-out"):
        write_run(Path(name), Motion(t_end=0.1))
    assert command.results_of(Path("named.nml")) == Path("here/results")
    assert command.results_of(Path("silent.nml")) == Path("mics-out")
    assert command.results_of(Path("mics-out/run.h5")) == Path("mics-out")
    Path("twice.nml").write_text(2 * Path("named.nml").read_text())  # for the program to refuse
    assert command.results_of(Path("twice.nml")) == Path("here/results")
    assert command.open_run(Path("mics-out")).bodies.n == 9


@pytest.mark.parametrize("case", sorted((ROOT / "input").glob("*.nml")))
def test_every_input_file_leads_to_its_folder(case: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadRun, match=r"mics-\w+, the output of .*, holds no run.h5"):
        command.results_of(case)


def test_a_wrong_folder_or_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("Dear reader,\nthis is no case.\n")
    (tmp_path / "bytes").write_bytes(bytes(range(256)))
    (tmp_path / "empty").mkdir()
    for name, problem in {
        "missing": "there is no such folder or file",
        "empty": "holds no run.h5",
        "bytes": "neither a folder of results nor a case",
        "letter.txt": "neither a folder of results nor a case",
    }.items():
        with pytest.raises((BadRun, OSError), match=f"^{tmp_path}/{name}:? .*{problem}"):
            _ = command.open_run(tmp_path / name).bodies


@pytest.mark.parametrize("script", OF_RUNS)
def test_a_script_refuses_in_one_line(script: str, tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("Dear reader,\nthis is no case.\n")
    said = one_line(call(script, tmp_path / "letter.txt"))
    assert said.startswith(f"{script}: {tmp_path}/letter.txt: neither")


def test_damaged_results_are_named(tmp_path: Path) -> None:
    for name in ("other", "broken"):
        (tmp_path / name).mkdir()
    with h5py.File(tmp_path / "other" / "run.h5", "w") as h5:
        h5["x"] = 1.0
    (tmp_path / "broken" / "run.h5").write_text("not HDF5")
    with pytest.raises(BadRun, match="not a whole result file"):
        _ = Run(tmp_path / "other").bodies
    assert "run.h5: cannot be read" in one_line(call("check_pile", tmp_path / "broken"))


def test_other_scripts_refuse_in_one_line(tmp_path: Path, loose_pile: Run) -> None:
    assert "no such file" in one_line(call("make_shape", "no.stl", "--out", tmp_path / "a.txt"))
    assert "nowhere" in one_line(call("bench_contact", "--program", tmp_path / "nowhere"))
    assert "no shape cube; there are: hexapod" in one_line(
        call("plot_shape", loose_pile.folder, "--shape", "cube")
    )
    (tmp_path / "file").write_text("")
    said = one_line(call("plot_history", loose_pile.folder, "--out", tmp_path / "file" / "a.png"))
    assert str(tmp_path / "file") in said


def test_the_reader_of_the_output_goes(tmp_path: Path) -> None:
    """As with `| head`: no traceback, and the code of the signal."""
    write_run(tmp_path / "run", Motion(t_end=0.1))
    for words in (["--help"], ["pile", str(tmp_path / "run")]):
        text = "import sys; from micstools.cli import main; main(sys.argv[1:])"
        program = [sys.executable, "-c", text, *words]
        with subprocess.Popen(
            program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT / "tools", text=True
        ) as running:
            assert running.stdout and running.stderr
            running.stdout.close()
            assert running.stderr.read() == ""
            assert running.wait() == 141
