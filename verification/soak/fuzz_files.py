"""Damaged input files: each must be refused with a message, or taken, soon and in little memory.

Good files are damaged one to three times: 10,000 cases, 3,000 of each other kind. The program
reads them with --check, and makes a few steps with those it takes. A failure is an end by a signal,
an exit code or message that is not the program's, 20 s, or 4 GB.

Files that failed are kept in build/fuzz. The program is ./mics_san, which finds most, if `make
SAN=1` has made it, else ./mics. Words: kinds.
"""

import os
import random
import re
import resource
import struct
import subprocess
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import trimesh

from run_cases import ROOT
from run_soak import Given

SAN = ROOT / "mics_san"
SECONDS = 20.0
MEMORY = 4 << 30  # bytes
TAKEN, REFUSED, NUMERICS, FILES, STOPPED = 0, 2, 3, 4, 143  # exit codes of the program
FEW_STEPS = ("--quiet", "--max-wall", "0:00:02")  # a damaged case may have become a long one
OWN = ("mics: ", "  ")  # how lines of the program begin, such that follow on

TEXTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text())


@dataclass(frozen=True)
class Kind:
    """How to make a good file of a kind, and the group of a case that reads it; without such a
    group the file is a case itself."""

    name: str
    good: Callable[[random.Random], bytes]
    group: str = ""
    number: str = ""  # struct format of the numbers of a binary file
    more: str = ""
    odd: Callable[[random.Random], bytes] | None = None  # files that are whole but wrong
    count: int = 3000  # files in a long test

    def case(self) -> str:
        """A small case in a tank of 1 m with the file."""
        return str(TEXTS["reading"].format(more=self.more, group=self.group))


def bar(form: str) -> Callable[[random.Random], bytes]:
    """A bar of one or four cubes, each cut into six tetrahedra, in a form of mesh files."""
    files = sorted((Path(__file__).parent / "good").glob(f"*.{form}"))
    return lambda rng: rng.choice(files).read_bytes()


def heightmap(rng: random.Random) -> bytes:
    """A map of heights that covers the tank."""
    n = rng.randint(2, 6), rng.randint(2, 6)
    rows = ["# a bed", f"{n[0]} {n[1]} 0 0 {1 / (n[0] - 1)!r} {1 / (n[1] - 1)!r}"]
    rows += [" ".join(f"{rng.uniform(0, 0.3):.3f}" for _ in range(n[0])) for _ in range(n[1])]
    return ("\n".join(rows) + "\n").encode()


def stl(rng: random.Random) -> bytes:
    """A tetrahedron in the tank as an STL file of either form."""
    corner, facets = (
        rng.uniform(0.1, 0.3) * np.eye(4, 3, -1),
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    )
    shift = [rng.uniform(0.1, 0.6), rng.uniform(0.1, 0.6), 0.1]
    stone = trimesh.Trimesh(corner + shift, facets, process=False)
    if rng.random() < 0.5:
        return str(stone.export(file_type="stl_ascii")).encode()
    return rng.choice([b"solid stone", b"stone"]).ljust(80) + stone.export(file_type="stl")[80:]


def initial_state(rng: random.Random, odd: bool = False) -> bytes:
    """An HDF5 file of an initial state; an odd one is wrong in some way h5py can write."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "state.h5"
        with h5py.File(path, "w", libver=rng.choice(["earliest", "latest"])) as h5:
            # A good state, plain, in chunks or compressed
            options: dict[str, object] = rng.choice([{}, {"chunks": True}, {"compression": "gzip"}])
            shares = np.random.default_rng(rng.randrange(1 << 30)).random((5, 4, 6))
            h5.create_dataset("liquid", data=shares, **options)
            if rng.random() < 0.5:
                h5.create_dataset("velocity", data=0.01 * np.ones((5, 4, 6, 3)), **options)
            if odd:
                odd_state(h5, rng)
        return path.read_bytes()


def odd_state(h5: h5py.File, rng: random.Random) -> None:
    """Replace the liquid by something that is not what should stand there, or by nothing."""
    del h5["liquid"]
    shape = (5, 4, 6)
    values = [
        np.full(shape, rng.choice([np.nan, np.inf, -1.0, 2.0, 1e308])),
        np.ones(rng.choice([(5, 4), (5, 4, 6, 1), (6, 4, 5), (0, 4, 6), ()])),
        np.full(shape, b"text", dtype=h5py.string_dtype(length=8)),
        np.full(shape, "text", dtype=h5py.string_dtype()),
        np.ones(shape, rng.choice(["i1", "u8", ">f4", "f2", ">f8", "i8"])),
        np.zeros(shape, [("a", "f8"), ("b", "i4")]),
        np.ones(shape, dtype=complex),
        h5py.SoftLink("/liquid"),
        h5py.ExternalLink("missing.h5", "/liquid"),
        h5py.Empty("f8"),
    ]
    match rng.randrange(len(values) + 4):
        case 0:
            h5.create_dataset("liquid", (10**6, 10**6, 10**6), "f8", chunks=(1, 1, 1000))
        case 1:
            h5.create_group("liquid")
        case 2:
            h5.create_dataset("liquid", shape, "f8")  # nothing written
        case 3:
            pass
        case way:
            h5["liquid"] = values[way - 4]


def small_case(rng: random.Random) -> bytes:
    """A case of any physics with some of all groups."""
    drawn = {name: rng.choice(words) for name, words in TEXTS["choices"].items()}
    text = str(TEXTS["case"].format(**drawn))
    return (text.split("&shape")[0] if drawn["physics"] == "fluid" else text).encode()


SHAPE = "&shape name = 'file'  kind = 'file'  file = 'file'  scale = 0.1  {} /\n"
PLACE = "&body shape = 'file'  position = 0.5, 0.5, 0.7 /"
BED = "&bed file = 'file'  kind = '{}' /"
DRY = "physics = 'dry'"
KINDS = {
    kind.name: kind
    for kind in (
        Kind("case", small_case, count=10000),
        Kind("msh", bar("msh"), SHAPE.format("") + PLACE, more=DRY),
        Kind("shape", bar("shape"), SHAPE.format("spheres = 'dense'") + PLACE, more=DRY),
        Kind("heightmap", heightmap, BED.format("heightmap"), more=DRY),
        Kind("stl", stl, BED.format("stl"), "<f", more=DRY),
        Kind(
            "initial_state",
            initial_state,
            "&fluid initial_state = 'file' /",
            number="<d",
            odd=lambda rng: initial_state(rng, odd=True),
        ),
    )
}


def damaged_text(data: bytes, rng: random.Random) -> bytes:
    """One fault in a text: of its lines, its sections, its words."""
    rows = data.split(b"\n")
    a, b = sorted(rng.randrange(len(rows) + 1) for _ in range(2))
    heads = [i for i, row in enumerate(rows) if re.match(rb"\s*[$A-Za-z]", row)] or [0]
    match rng.randrange(11):
        case 0:
            return b"\n".join(rows[:a] + rows[b:])  # lines are missing
        case 1:
            return b"\n".join(rows[:b] + rows[a:])  # or stand twice
        case 2:
            i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
            rows[i], rows[j] = rows[j], rows[i]
        case 3:  # a section is missing, or comes again, cut
            begin = rng.choice(heads)
            end = min((h for h in heads if h > begin), default=len(rows))
            if rng.random() < 0.5:
                return b"\n".join(rows[:begin] + rows[end:])
            again = rows[begin : end - rng.randint(0, (end - begin) // 2)]
            if again:
                again[0] = re.sub(rb"\d+", lambda m: b"%d" % (int(m[0]) // 2), again[0])
            return b"\n".join([*rows, *again]) + b"\n"
        case 4:
            return b"\r\n".join(rows) if rng.random() < 0.7 else b"\r".join(rows)
        case 5:  # a long line, a long word
            rows.insert(a, (b"1 " if rng.random() < 0.5 else b"x") * 100000)
        case 6:
            return b" ".join(rows)
        case _:
            # One word, a number if possible, becomes another
            words = list(re.finditer(rb"[^\s]+", data))
            numbers = [w for w in words if re.fullmatch(rb"[-+.\deE]+", w[0])]
            if not words:
                return data
            word = rng.choice(numbers if numbers and rng.random() < 0.9 else words)
            new = rng.choice(TEXTS["nasty"]).encode("latin-1")
            if rng.random() < 0.2:
                new = rng.choice(words)[0]
            if rng.random() < 0.2 and re.fullmatch(rb"\d+", word[0]):
                new = b"%d" % max(0, int(word[0]) + rng.choice([-1, 1]))
            return data[: word.start()] + new + data[word.end() :]
    return b"\n".join(rows)


def damaged_bytes(data: bytes, rng: random.Random, number: str) -> bytes:
    """One fault in the bytes of a file."""
    block = bytearray(data)
    at = rng.randrange(len(block) + 1)
    match rng.randrange(6 if number else 4):
        case 0:
            return bytes(block[:at])
        case 1:
            for _ in range(rng.randint(1, 20)):
                block[rng.randrange(len(block))] = rng.randrange(256)
        case 2:
            end = min(len(block), at + rng.randint(1, 200))
            del block[at:end]
        case 3:
            block[at:at] = block[at : at + rng.randint(1, 200)]
        case 4:  # another number
            value = rng.choice([np.nan, np.inf, -np.inf, 1e30, -1e30, 1e8, -1e8, 1e-40, 0.0])
            at -= at % 2
            block[at : at + struct.calcsize(number)] = struct.pack(number, value)
        case 5:  # another count
            count = rng.choice([0, 1, 3, 5, 1 << 20, (1 << 31) - 1, (1 << 32) - 1])
            at = rng.choice([80, at])
            block[at : at + 4] = struct.pack("<I", count)
    return bytes(block)


def damaged(kind: Kind, rng: random.Random) -> bytes:
    """A file of the kind with one to three faults; few are empty."""
    if kind.odd and rng.random() < 0.3:
        return kind.odd(rng)
    data = kind.good(rng)
    for _ in range(rng.randint(1, 3)):
        if not data or rng.random() < 0.01:
            return b""
        text = b"\0" not in data[:200]
        if text and rng.random() < 0.8:
            data = damaged_text(data, rng)
        else:
            data = damaged_bytes(data, rng, kind.number if not text else "")
    return data


def run(program: Path, arguments: list[str], folder: Path) -> tuple[int, str]:
    """Exit code and messages of the program; the code is -1 when it takes too long."""
    sanitized = program.name.endswith("_san")

    def limit() -> None:
        if not sanitized:  # those need terabytes of address space; their own limit is set below
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    settings = {
        "OMP_NUM_THREADS": "1",
        "ASAN_OPTIONS": f"detect_leaks=0:hard_rss_limit_mb={MEMORY >> 20}",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }
    try:
        done = subprocess.run(
            [program, *arguments, "case.nml"],
            cwd=folder,
            env={**os.environ, **settings},
            capture_output=True,
            timeout=SECONDS * (5 if sanitized else 1),
            preexec_fn=limit,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -1, "takes too long"
    return done.returncode, done.stderr.decode("utf-8", "replace")


def fault_of(code: int, errors: str, allowed: tuple[int, ...]) -> str:
    """What is wrong with the way the program ended; empty if nothing is."""
    rows = errors.replace("\t", " ").splitlines()  # a tab may stand in a text
    if code not in allowed:
        return f"ended with {code}: {errors[:2000]}"
    foreign = [row for row in rows if not row.startswith(OWN) or not row.isprintable()]
    if foreign:
        return f"not a message of the program: {foreign[0][:300]!r}"
    if code != TAKEN and not rows:
        return f"ended with {code} without a message"
    if any(len(row) > 500 for row in rows):
        return "a message longer than 500 characters"
    return ""


def try_file(kind: Kind, data: bytes, program: Path) -> tuple[int, str]:
    """Exit code of --check with a file, and what is wrong with its end, or that of a few steps."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "file").write_bytes(data)
        (folder / "case.nml").write_bytes(kind.case().encode() if kind.group else data)
        code, errors = run(program, ["--check"], folder)
        fault = fault_of(code, errors, (TAKEN, REFUSED, FILES))
        if not fault and code != TAKEN and len(list(folder.iterdir())) > 2:
            fault = "refused, but something was written"
        if code == TAKEN and not fault:
            ended, errors = run(program, [*FEW_STEPS], folder)
            fault = fault_of(ended, errors, (TAKEN, REFUSED, NUMERICS, FILES, STOPPED))
    return code, fault


def trials(given: Given, work: Path) -> Iterator[tuple[str, list[str]]]:
    """A line for each kind: how its files ended."""
    program, keep = given.program or (SAN if SAN.exists() else ROOT / "mics"), ROOT / "build/fuzz"
    for name in given.words or KINDS:
        kind, ends, faults = KINDS[name], Counter[str](), []
        for i in range(given.n or kind.count):
            data = damaged(kind, random.Random(f"{name} {given.seed} {i}"))
            code, fault = try_file(kind, data, program.resolve())
            how = {TAKEN: "taken", REFUSED: "refused", FILES: "unreadable"}
            ends["failed" if fault else how[code]] += 1
            if fault:
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{name}-{given.seed}-{i}").write_bytes(data)
                faults.append(f"{given.seed} {i}: {fault}")
        yield f"{name} {dict(sorted(ends.items()))}", faults
