"""Damaged and foreign result files are told in one line with the file's name."""

import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from micstools import cli
from micstools.reading import result_file
from micstools.reading.reader import BadRun, Run
from micstools.serve import living
from synthetic import Motion, write_run

Damage = Callable[[h5py.File], None]


def put(name: str, values: object, **how: object) -> Damage:
    """Other values in the place of a dataset."""

    def damage(h5: h5py.File) -> None:
        if name in h5:
            del h5[name]
        if how:
            h5.create_dataset(name, **how)
        elif not isinstance(values, (h5py.SoftLink, h5py.ExternalLink)):
            h5.create_dataset(name, data=values)
        else:
            h5[name] = values

    return damage


def drop(name: str) -> Damage:
    def damage(h5: h5py.File) -> None:
        del h5[name]

    return damage


def say(name: str, value: object) -> Damage:
    def damage(h5: h5py.File) -> None:
        h5["provenance"].attrs[name] = value

    return damage


def elsewhere(h5: h5py.File) -> None:
    del h5["bodies/mass"]
    layout = h5py.VirtualLayout(shape=(9,), dtype=float)
    layout[:] = h5py.VirtualSource("other.h5", "mass", shape=(9,))
    h5.create_virtual_dataset("bodies/mass", layout)


KINDS: dict[str, Damage] = {
    "no bodies": drop("bodies"),
    "no series": drop("series"),
    "no grid": drop("grid"),
    "no provenance": drop("provenance"),
    "no shapes": drop("shapes"),
    "a column is missing": drop("bodies/velocity"),
    "a group for a dataset": lambda h5: (drop("bodies/mass")(h5), h5.create_group("bodies/mass")),
    "a dataset for a group": put("series", [1.0]),
    "texts for numbers": put("bodies/mass", ["a"] * 9),
    "another number of bodies": put("bodies/mass", np.ones(4)),
    "vectors of two": put("bodies/position", np.zeros((11, 9, 2))),
    "a single number": put("series/time", 1.0),
    "times that fall": put("series/time", np.arange(11.0)[::-1]),
    "a time that is none": put("bodies/time", np.full(11, np.nan)),
    "no cells": put("grid/x", [0.0]),
    "a corner that is not there": put("shapes/hexapod/triangles", [[0, 1, 10**6]]),
    "a shape of no name": put("bodies/shape", [b"\xff\xfe"] * 9),
    "a status in words": say("exit_status", "well"),
    "words for a number": say("parameters", "&run t_end = 'soon' /"),
    "no namelist": say("parameters", "&run t_end = ((("),
    "a huge repeat": say("parameters", "&run t_end = 999999999*0.1 /"),
    "more than it holds": put("bodies/mass", None, shape=(10**12,), dtype=float, chunks=(10**6,)),
    "data in another file": put("bodies/mass", None, shape=(9,), dtype=float,
                                external=[("/etc/passwd", 0, 72)]),
    "virtual data": elsewhere,
    "a link outside": put("bodies", h5py.ExternalLink("/etc/passwd", "/bodies")),
    "a link inside": put("bodies/mass", h5py.SoftLink("/bodies/time")),
}  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("whole") / "run", Motion(t_end=0.2))


@pytest.fixture
def broken(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy, and no patience with it."""
    monkeypatch.setattr(result_file.take, "__defaults__", ((),))
    return shutil.copytree(whole, tmp_path / "run")


def look(run: Run) -> None:
    """All that is read of a run."""
    str(run), run.shapes, run.bed, run.series, run.timers, run.sides, run.gravity  # noqa: B018
    living.state(run)


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_one_line(broken: Path, kind: str, capsys) -> None:
    with h5py.File(broken / "run.h5", "r+") as h5:
        KINDS[kind](h5)
    with pytest.raises(BadRun, match=r"run\.h5: .*") as told:
        look(Run(broken))
    assert "\n" not in str(told.value)
    with pytest.raises(SystemExit) as end:
        cli.main(["report", str(broken)])
    (line,) = capsys.readouterr().err.splitlines()
    assert end.value.code == 2 and line.startswith(f"mics-tools report: {broken}/run.h5: ")


def test_a_file_of_other_bytes_is_one_line(broken: Path) -> None:
    """Cut anywhere, or with zeros in the place of a part."""
    content = (broken / "run.h5").read_bytes()
    for n in range(0, len(content), len(content) // 40):
        for damaged in (content[:n], content[:n] + bytes(512) + content[n + 512 :]):
            (broken / "run.h5").write_bytes(damaged)
            try:
                look(Run(broken))
            except BadRun as told:
                assert str(told).startswith(f"{broken}/run.h5: ") and "\n" not in str(told)
