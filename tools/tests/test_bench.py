"""The bench: its system is the one that others publish, its figures add up, an old one compares."""

import json
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from micstools.bench import jobs, parts, peer_interfoam, pressure_dump, table
from micstools.bench.jobs import DAM, Job
from micstools.bench.timing import Timing, timed
from micstools.cases import program
from micstools.reading.reader import BadRun


def test_the_pressure_system_is_the_published_one() -> None:
    """Mean density and length of the right side, from another program that writes the same."""
    assert pressure_dump.density((60, 20, 40)).mean() == pytest.approx(867.1087731, abs=1e-7)
    assert np.linalg.norm(pressure_dump.right_side((60, 20, 40))) == pytest.approx(137.870097729)


def test_a_system_that_was_written_is_symmetric_and_open_at_the_top(tmp_path: Path) -> None:
    path = pressure_dump.write(tmp_path / "system.bin", (6, 4, 5))
    cells, (cx, cy, cz), right = pressure_dump.read(path)
    assert cells == [6, 4, 5] and right.shape == (5, 4, 6)
    assert not cx[:, :, [0, -1]].any() and not cy[:, [0, -1]].any() and not cz[0].any()
    rho, h = pressure_dump.density((6, 4, 5)), pressure_dump.LENGTH / cells
    assert cz[-1] == pytest.approx(2 / (rho[-1] * h[2] ** 2))
    assert cx[2, 1, 3] == pytest.approx(2 / ((rho[2, 1, 2] + rho[2, 1, 3]) * h[0] ** 2))
    (tmp_path / "other.bin").write_bytes(b"something else")
    with pytest.raises(ValueError, match="holds no pressure system"):
        pressure_dump.read(tmp_path / "other.bin")


def test_a_job_of_the_program(tmp_path: Path) -> None:
    try:
        path = program.find()
    except BadRun:
        pytest.skip("mics is not built")
    dam = replace(DAM, cells=(16, 1, 8), length=(0.6, 0.0375, 0.3), column=(0.15, 0.0375, 0.2),
                  seconds=0.02)  # fmt: skip
    runs = [jobs.run(Job("dam", jobs.dam_break(dam)), (path, path), tmp_path)]
    found = parts.row("jobs", "dam_break", runs)
    assert found["size"] == 128 and found["simulated"] == pytest.approx(0.02)
    assert sum(found["phases"].values()) == pytest.approx(1.0, abs=1e-3)
    assert 1e6 < found["memory"] < 1e9
    assert "s a s" in table.line(found)


def test_the_fastest_run_is_told_and_the_slowest() -> None:
    runs = [Timing(3.0, 2.5, 1e6, 0.5, 10, 1000), Timing(2.0, 1.9, 1e6, 0.5, 10, 1000)]
    found = parts.row("jobs", "blocks", runs)
    assert (found["wall"], found["spread"], found["ns"]) == (2.0, 0.5, 1.9e5)
    assert "step_ms" not in found


def bench(tmp_path: Path, cpu: float, **about: str) -> dict:
    runs = [Timing(cpu, cpu, 1e6, 0.5, 10, 1000)]
    rows = [parts.row("jobs", "blocks", runs), parts.row("growth", str(cpu), runs)]
    found = {"version": "mics 1", "processor": "this", "rows": rows} | about
    (tmp_path / "bench.json").write_text(json.dumps(found))
    return found


def test_two_benches_beside_each_other(tmp_path: Path) -> None:
    bench(tmp_path, 4.0, processor="that")
    old = table.read(tmp_path / "bench.json")
    said = table.beside(bench(tmp_path, 3.0), old).splitlines()
    assert said[0] == "times what mics 1 took"
    assert "another processor, that" in said[1]
    assert said[2].endswith("wall 0.75, cpu 0.75, steps 1.00")
    assert said[3].endswith("new") and said[4].endswith("not in this one")


@pytest.mark.parametrize("text", ["{", "[]", '{"jobs": []}', '{"rows": [{}]}'])
def test_what_is_no_bench_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "old.json").write_text(text)
    with pytest.raises(BadRun, match="is no bench"):
        table.read(tmp_path / "old.json")


def test_a_program_that_fails_is_named(tmp_path: Path) -> None:
    with pytest.raises(subprocess.SubprocessError, match="sh ended with 3: too bad"):
        timed(["sh", "-c", "echo fine; echo too bad; exit 3"], tmp_path)


def test_the_dam_break_of_interfoam_holds_the_same_water(tmp_path: Path) -> None:
    peer_interfoam.write_case(tmp_path)
    text = (tmp_path / "0" / "alpha.water").read_text()
    shares = [float(v) for v in text[text.index("> ") :].split("(")[1].split(")")[0].split()]
    volume = sum(shares) / len(shares) * np.prod(DAM.length)
    assert volume == pytest.approx(np.prod(DAM.column))
