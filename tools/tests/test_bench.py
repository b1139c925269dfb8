"""The bench: its figures add up, an old one compares."""

import json
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from calls import MICS, needs_mics
from micstools.bench import jobs, parts, table
from micstools.bench.jobs import DAM, Job
from micstools.bench.timing import Timing, timed
from micstools.reading.reader import BadRun


@needs_mics
def test_a_job_of_the_program(tmp_path: Path) -> None:
    dam = replace(DAM, cells=(16, 1, 8), length=(0.6, 0.0375, 0.3), column=(0.15, 0.0375, 0.2),
                  seconds=0.02)  # fmt: skip
    runs = [jobs.run(Job("dam", jobs.dam_break(dam)), (MICS, MICS), tmp_path)]
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
