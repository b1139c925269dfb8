"""What strangers send to the pages and the tools: each is answered in order, nothing is lost.

2,000 fuzzed requests to a served run, in twenty lots: no answer is 500, and the site still serves.
500 times run.h5 is damaged in one of 20 ways, at a random object: a tool writes its files, or ends
with 2 and one line with its name. 100 times one of two browsers that edit one case types and saves:
what it shows then is in the file, over a change of the other it chooses; remarks stay. Words:
requests, files, browsers.
"""

import contextlib
import io
import logging
import random
import re
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np

from run_cases import ROOT
from run_soak import Given

sys.path.append(str(ROOT / "tools" / "tests"))

from browser import Browser  # noqa: E402
from micstools import cli  # noqa: E402
from micstools.serve import studio, watch  # noqa: E402
from synthetic import Motion, write_run  # noqa: E402
from test_serve import (  # noqa: E402
    CASE,
    MICS,
    VERDICT,
    attack_with_requests,
    field,
    request,
    serving,
    type_into,
    until,
)  # fmt: skip

Damage = Callable[[h5py.File, str, random.Random], object]


def new(h5: h5py.File, name: str, values: object) -> None:
    """Other values in the place of an object."""
    del h5[name]
    h5[name] = values


def filled(value: float) -> Damage:
    """A number in some of the places of a dataset."""

    def damage(h5: h5py.File, name: str, draw: random.Random) -> None:
        values = np.array(h5[name], dtype=float)
        values.flat[:: draw.randint(1, 5)] = value
        new(h5, name, values)

    return damage


NUMBERS: dict[str, Damage] = {
    "texts": lambda h5, name, _: new(h5, name, ["a"] * len(h5[name])),
    "one number": lambda h5, name, _: new(h5, name, 1.0),
    "no rows": lambda h5, name, _: new(h5, name, h5[name][:0]),
    "half of it": lambda h5, name, _: new(h5, name, h5[name][: len(h5[name]) // 2]),
    "twice": lambda h5, name, _: new(h5, name, np.concatenate([h5[name][:]] * 2)),
    "flat": lambda h5, name, _: new(h5, name, h5[name][:].ravel()),
    "one more axis": lambda h5, name, _: new(h5, name, h5[name][:][..., None]),
    "the other way": lambda h5, name, _: new(h5, name, h5[name][:][::-1]),
    "whole numbers": lambda h5, name, _: new(h5, name, h5[name][:].astype(int)),
    "nan": filled(np.nan),
    "infinite": filled(-np.inf),
    "huge": filled(1e300),
    "negative": filled(-1.0),
}
OBJECTS: dict[str, Damage] = {
    "gone": lambda h5, name, _: h5.__delitem__(name),
    "a group": lambda h5, name, _: (h5.__delitem__(name), h5.create_group(name)),
    "a link out": lambda h5, name, _: new(h5, name, h5py.ExternalLink("/etc/passwd", "/a")),
    "a link to itself": lambda h5, name, _: new(h5, name, h5py.SoftLink(f"/{name}")),
}
BYTES = ("cut", "zeros", "other bytes")
WAYS = (*NUMBERS, *OBJECTS, *BYTES)


def damage(way: str, path: Path, draw: random.Random) -> str:
    """Damage a file; where."""
    if way in BYTES:
        content = bytearray(path.read_bytes())
        at, size = draw.randrange(len(content)), draw.randint(1, 600)
        more = {"cut": b"", "zeros": bytes(size), "other bytes": draw.randbytes(size)}[way]
        content[at : at + size if more else None] = more
        path.write_bytes(content)
        return f"byte {at}"
    with h5py.File(path, "r+") as h5:
        names = list[str]()
        h5.visit(names.append)
        if way in NUMBERS:
            names = [n for n in names if isinstance(h5[n], h5py.Dataset) and h5[n].dtype.kind == "f"
                     and h5[n].ndim and h5[n].size]  # fmt: skip
        name = draw.choice(names)
        {**NUMBERS, **OBJECTS}[way](h5, name, draw)
    return name


def told_in_a_line(command: str, folder: Path) -> list[str]:
    """What is wrong with the end of a command on a damaged run."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            cli.main([*command.split(), str(folder)])
    except SystemExit as end:
        lines = said.getvalue().splitlines()
        well = not end.code or (end.code == 2 and len(lines) == 1 and str(folder) in lines[0])
        return [] if well else [f"{command}: exit code {end.code}: {said.getvalue()[:300]}"]
    except Exception:  # noqa: BLE001 - any is a failure
        return [f"{command}: {traceback.format_exc(limit=-2)}"]
    return [f"{command}: does not end"]


def damaged_run(way: str, whole: Path, draw: random.Random, work: Path) -> tuple[str, list[str]]:
    """One run.h5 and all that does not hold."""
    folder = work / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(whole, folder)
    where = damage(way, folder / "run.h5", draw)
    command = draw.choice(["places", "report", "pile", "export --to csv,glb,obj"])
    return f"run.h5 {way}: {where}, {command}", told_in_a_line(command, folder)


def edit(window: Browser, draw: random.Random, case: Path) -> list[str]:
    """A window changes the text or a field and saves; over a stale state it chooses."""
    if draw.random() < 0.5:
        window.run("document.querySelector('[data-show=text]').click()")
        window.run(f"{field('text')}.focus()")
        window.run(f"{field('text')}.setSelectionRange(0, 0)")
        window.key("!")
    else:
        window.run("document.querySelector('[data-show=form]').click()")
        type_into(window, "shape-0-size", f"0.0{draw.randint(4000, 6000)}")
    time.sleep(draw.choice([0.0, 0.1, 0.5, 1.0]))
    window.run(f"{field('save')}.click()")
    stale = "document.getElementById('stale').open"

    def settled() -> bool:
        if window.run(stale):
            text = draw.choice(["theirs", "mine"])
            window.run(f"document.querySelector('#stale [value={text}]').click()")
            until(lambda: not window.run(stale), 20)
            window.run(f"{field('save')}.click()")
        shown = window.run(f"{field('save')}.disabled && {field('text')}.value")
        return bool(shown == case.read_text())  # and nothing is still to be sent or saved

    try:
        until(settled, 20)
    except AssertionError:
        return [f"shown and saved differ: {window.run(field('text') + '.value')!r}"]
    return [] if "! a remark that stays" in case.read_text() else ["the remark is gone"]


def two_browsers(n: int, draw: random.Random, work: Path) -> Iterator[tuple[str, list[str]]]:
    """One of two windows at a time, often before the other has seen the change."""
    case = work / "case.nml"
    case.write_text(CASE)
    site = studio.site_of(case, MICS)
    with serving(site) as address, Browser(work / "a") as a, Browser(work / "b") as b:
        for window, begin in ((a, address), (b, site.address())):
            window.visit(begin, 1200, 900)
            until(lambda: window.run(VERDICT).startswith("Accepted"))  # noqa: B023
        for i in range(n):
            k = draw.randrange(2)
            found = edit((a, b)[k], draw, case)
            found += [e for e in a.errors + b.errors if not re.search("409|422", e)]
            a.errors.clear()
            b.errors.clear()
            yield f"window {k + 1} edits, {i + 1} of {n}", found


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """Requests, files and browsers in turn."""
    words, draw = given.words or ("requests", "files", "browsers"), random.Random(given.seed)
    whole = write_run(work / "run", Motion(t_end=0.5))
    if "requests" in words:
        logging.getLogger("aiohttp").setLevel(logging.CRITICAL)  # it tells of every bad request
        with serving(site := watch.site_of(whole)):
            for lot in range(20):
                found = list[str]()
                try:
                    attack_with_requests(site, (given.n or 2000) // 20, 100 * given.seed + lot)
                    assert request(site, "/")[0] == 200
                except Exception:  # noqa: BLE001 - any is a failure
                    found.append(traceback.format_exc(limit=-1))
                yield f"requests, lot {lot + 1}", found
    if "files" in words:
        for i in range(given.n or 500):
            yield damaged_run(WAYS[i % len(WAYS)], whole, draw, work)
    if "browsers" in words:
        yield from two_browsers(given.n or 100, draw, work)
