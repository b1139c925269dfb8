"""The result files of real runs: names and units of the contract, values that fit together, what is
left after faults, and that ParaView's reader sees them."""

import fcntl
import os
import shutil
import signal
import subprocess
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista

from micstools.reading.reader import Run
from micstools.shapes.geometry import rotation_matrix
from run_cases import CASES, ROOT, Machine
from same_bits import but_restarts, differences
from shared_runs import SharedRun, texts
from soak import shop

MICS = ROOT / "mics"
ALONE = Machine(MICS, threads=1)
CASE = CASES / "ranks" / "coupled.nml"
LONG = ROOT / "input" / "blocks_coarse.nml"
GRAVITY = np.array([0.0, 0.0, -9.81])
TEXTS = texts("output")
CONTRACT = tomllib.loads((ROOT / "verification" / "contract.toml").read_text())
SERIES, BODY_ROWS = CONTRACT["series"], CONTRACT["bodies"]


def start(
    output: Path | None, *more: str | Path, case: Path = CASE, **settings
) -> subprocess.Popen:
    """Start a quiet run on one thread."""
    where = [] if output is None else ["--output", output]
    return shop.start(ALONE, *where, *more, case, **settings)


def run(output: Path | None, *more: str | Path, case: Path = CASE, **settings) -> tuple[int, str]:
    """Run to the end; the exit code and what was said on standard error."""
    process = start(output, *more, case=case, **settings)
    said = process.communicate(timeout=300)[1]
    return process.returncode, said


def wait_for_rows(process: subprocess.Popen, output: Path, rows: int) -> None:
    """Until the growing file shows so many rows, or the run has ended."""
    while len(shop.column(output, "series/wall_time")) < rows and process.poll() is None:
        time.sleep(0.002)


def opened(path: Path) -> h5py.File:
    return h5py.File(path, "r", locking=False)


@pytest.fixture
def wet(shared_run: SharedRun) -> Path:
    """Results of a coupled run with a fixed, a free and a dropped block."""
    return shared_run("coupled", ALONE)


@pytest.fixture
def dry(shared_run: SharedRun) -> Path:
    """Results of a run without fluid."""
    return shared_run("dry", ALONE)


@pytest.fixture
def fluid(shared_run: SharedRun) -> Path:
    """Results of a run without blocks."""
    return shared_run("stream", ALONE)


def test_names_units_and_shapes(wet: Path) -> None:
    with opened(wet / "run.h5") as h5:
        assert h5.attrs["format"] == "mics-run"
        assert h5.attrs["format_version"] == 1
        rows, bodies = len(h5["series/time"]), len(h5["bodies/mass"])
        assert bodies == 3
        for name, (units, *more) in BODY_ROWS.items():
            wanted = (rows,) if name == "time" else (rows, bodies, *more)
            assert h5[f"bodies/{name}"].shape == wanted, name
            assert h5[f"bodies/{name}"].attrs["units"] == units, name
        assert {n: d.attrs["units"] for n, d in h5["series"].items()} == SERIES
        assert all(d.shape == (rows,) for d in h5["series"].values())
        assert set(h5["bodies"]) == {*BODY_ROWS, *CONTRACT["each_body"]}
        for axis, cells in zip("xyz", (24, 16, 32), strict=True):
            assert h5[f"grid/{axis}"].shape == (cells + 1,)
        assert h5["grid/z"][-1] == pytest.approx(0.2, abs=1e-15)
        names = list[str]()
        h5.visit(names.append)
        items = {name: h5[name] for name in names}
        assert [n for n, d in items.items() if hasattr(d, "dtype") and "units" not in d.attrs] == []


def test_provenance(wet: Path) -> None:
    with opened(wet / "run.h5") as h5:
        made = dict(h5["provenance"].attrs)
        assert made["namelist"] == CASE.read_text()
        for default in ("cfl_max = 0.5", "gas_density = 1.204", "coupling = 'monolithic'"):
            assert default in made["parameters"]
        assert made["threads"] == made["ranks"] == 1
        assert made["exit_status"] == 0
        assert made["started"] <= made["finished"]
        assert {"version", "git_revision", "compiler", "flags"} <= made.keys()
        assert len(h5["timers/name"]) == len(h5["timers/seconds"]) == len(h5["timers/calls"]) > 0


def test_shapes(wet: Path) -> None:
    """Volume of the tetrahedra, and the closed surface around them."""
    with opened(wet / "run.h5") as h5:
        for name, shape in h5["shapes"].items():
            points = shape["points"][:]
            a, b, c, d = np.moveaxis(points[shape["tets"][:]], 1, 0)
            volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6
            assert volumes.sum() == pytest.approx(shape.attrs["volume"], rel=1e-12), name
            centroid = (volumes[:, None] * (a + b + c + d) / 4).sum(0)
            assert np.abs(centroid).max() < 1e-12 * shape.attrs["volume"], name
            a, b, c = np.moveaxis(points[shape["triangles"][:]], 1, 0)
            inside = np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6
            assert inside == pytest.approx(shape.attrs["volume"], rel=1e-12), name
            assert shape.attrs["inertia"].shape == (3, 3)
        mass = h5["bodies/mass"][0]
        assert mass == pytest.approx(2300 * h5["shapes/hexapod"].attrs["volume"], rel=1e-14)


def test_rows(wet: Path) -> None:
    with opened(wet / "run.h5") as h5:
        t = h5["series/time"][:]
        assert np.array_equal(t, h5["bodies/time"][:])
        assert t[0] == 0
        assert t[-1] == 0.08
        assert np.allclose(np.diff(t), h5["series/dt"][1:], rtol=0, atol=1e-15)
        assert np.all(np.diff(h5["series/wall_time"][:]) > 0)
        q = h5["bodies/quaternion"][:]
        assert np.all(q[0, :, 0] >= 0)
        assert np.allclose(np.linalg.norm(q, axis=2), 1, rtol=0, atol=1e-14)
        assert np.all(np.einsum("tni,tni->tn", q[1:], q[:-1]) > 0.9)
        for name in ("fluid_force", "fluid_torque", "contact_force", "contact_torque", "contacts"):
            assert not h5[f"bodies/{name}"][0].any(), name
        assert np.abs(h5["series/liquid_volume_drift"][:]).max() < 1e-9


def test_forces_change_the_momentum(wet: Path) -> None:
    """M dU/dt = fluid + contact + M g over every step of the free blocks, to round-off."""
    with opened(wet / "run.h5") as h5:
        dt, mass = h5["series/dt"][1:], h5["bodies/mass"][:]
        force = h5["bodies/fluid_force"][1:] + h5["bodies/contact_force"][1:]
        v = h5["bodies/velocity"][:]
        change = mass[:, None] * np.diff(v, axis=0) / dt[:, None, None] - mass[:, None] * GRAVITY
        moved = h5["bodies/time"][:-1][:, None] >= h5["bodies/release_time"][:] - 1e-12
        moved &= h5["bodies/fixed"][:] == 0
        first = np.flatnonzero(moved[:, 2])[0]
        assert np.allclose(v[: first + 1, 2], 0)
        moved[first, 2] = False  # given its first velocity in this step
        assert moved.sum() > 20
        largest = np.abs(force[moved]).max()
        assert np.abs(change - force)[moved].max() < 1e-10 * largest


def test_frames_of_the_fluid(wet: Path) -> None:
    """Frames hold the liquid that the series counts, at the times of rows."""
    with opened(wet / "run.h5") as run_h5, opened(wet / "fields.vtkhdf") as h5:
        steps, data = h5["VTKHDF/Steps"], h5["VTKHDF/CellData"]
        times = steps["Values"][:]
        assert len(times) == steps.attrs["NSteps"] == 5
        assert times[0] == 0
        assert times[-1] == 0.08
        assert np.all(times[1:] >= 0.02 * np.arange(1, 5) - 1e-12)
        volume = np.prod(h5["VTKHDF"].attrs["Spacing"])
        row = np.searchsorted(run_h5["series/time"][:], times)
        assert np.array_equal(run_h5["series/time"][:][row], times)
        for name, units in CONTRACT["fields"].items():
            assert data[name].dtype == np.float32
            assert data[name].attrs["units"] == units
            assert data[name].compression == "gzip"
            assert np.isfinite(data[name][:]).all()
        for frame in range(5):
            liquid = (data["liquid"][frame].astype(float) * (1.0 - data["solid"][frame])).sum()
            wanted = run_h5["series/liquid_volume"][row[frame]]
            assert liquid * volume == pytest.approx(wanted, rel=1e-6)


def seen_by_vtk(path: Path, frame: int) -> pyvista.DataSet:
    """A frame as the reader of ParaView and pyvista gives it."""
    reader = pyvista.get_reader(path).reader
    reader.UpdateInformation()
    reader.SetStep(frame)
    reader.Update()
    return pyvista.wrap(reader.GetOutput())


def test_files_end_with_what_they_hold(wet: Path) -> None:
    """Room that was asked for before a frame or a row came is given back."""
    for name in ("run.h5", "fields.vtkhdf", "blocks.vtkhdf", "restart-a.h5"):
        content = (wet / name).read_bytes()
        assert len(content) - len(content.rstrip(b"\0")) < 4096, name


def test_vtk_reads_the_fluid(wet: Path) -> None:
    with opened(wet / "fields.vtkhdf") as h5:
        for frame in (0, 2, 4):
            seen = seen_by_vtk(wet / "fields.vtkhdf", frame)
            assert seen.dimensions == (25, 17, 33)
            assert seen.bounds == pytest.approx((0, 0.15, 0, 0.1, 0, 0.2), abs=1e-12)
            for name in ("liquid", "solid", "pressure"):
                wanted = h5[f"VTKHDF/CellData/{name}"][frame]
                assert np.array_equal(seen.cell_data[name].reshape(wanted.shape), wanted)
            wanted = h5["VTKHDF/CellData/velocity"][frame]
            assert np.array_equal(seen.cell_data["velocity"].reshape(wanted.shape), wanted)


def test_vtk_reads_the_blocks(wet: Path) -> None:
    """Points and their velocities follow from the poses in run.h5."""
    with opened(wet / "run.h5") as h5, opened(wet / "blocks.vtkhdf") as frames:
        times = frames["VTKHDF/Steps/Values"][:]
        assert np.array_equal(times, opened(wet / "fields.vtkhdf")["VTKHDF/Steps/Values"][:])
        for frame in (0, 1, 4):
            seen = seen_by_vtk(wet / "blocks.vtkhdf", frame)
            row = int(np.flatnonzero(h5["bodies/time"][:] == times[frame])[0])
            first = 0
            fixed, due = h5["bodies/fixed"][:], h5["bodies/release_time"][:]
            for body, name in enumerate(h5["bodies/shape"][:]):
                shape = h5[f"shapes/{name.decode()}"]
                turn = rotation_matrix(h5["bodies/quaternion"][row, body])
                arm = shape["points"][:] @ turn.T
                part = slice(first, first + len(arm))
                first += len(arm)
                at = h5["bodies/position"][row, body] + arm
                v = h5["bodies/velocity"][row, body] + np.cross(
                    h5["bodies/angular_velocity"][row, body], arm
                )
                assert np.allclose(seen.points[part], at, rtol=0, atol=1e-12)
                assert np.allclose(seen.point_data["velocity"][part], v, rtol=1e-6, atol=1e-6)
                triangles = len(shape["triangles"])
                mine = seen.cell_data["body"] == body + 1  # for people, blocks count from 1
                assert mine.sum() == triangles
                assert (seen.cell_data["fixed"][mine] == fixed[body]).all()
                there = due[body] == 0 or due[body] < times[frame]  # released as a step begins
                assert (seen.cell_data["released"][mine] == there).all()
            assert seen.n_points == first


def test_frames_keep_their_digits_in_map_coordinates(tmp_path: Path) -> None:
    """A tank with the coordinates of a map: the block has its size, the fluid its place."""
    case, out = tmp_path / "case.nml", tmp_path / "out"
    case.write_text(TEXTS["far"])
    assert run(out, case=case) == (0, "")
    block, fluid = (seen_by_vtk(out / f"{name}.vtkhdf", 1) for name in ("blocks", "fields"))
    low, high = np.array(block.bounds).reshape(3, 2).T
    assert high - low == pytest.approx([0.063] * 3, rel=0, abs=1e-9)
    assert (low + high) / 2 == pytest.approx([354200.21, 562108.17, -11.8], rel=0, abs=1e-9)
    low, high = np.array(fluid.bounds).reshape(3, 2).T
    assert low == pytest.approx([354200, 562108, -12], rel=0, abs=1e-9)
    assert high - low == pytest.approx([0.4] * 3, rel=0, abs=1e-9)


@pytest.mark.parametrize("name", ["liquid", "velocity", "pressure"])
def test_changed_frame(name: str, fluid: Path, tmp_path: Path) -> None:
    """A frame that was changed on the disk is not taken for a good one: one bit of a chunk of a
    field, anywhere in it, and HDF5 refuses the chunk."""
    file = Path(shutil.copy(fluid / "fields.vtkhdf", tmp_path))
    with h5py.File(file) as h5:
        field = h5[f"VTKHDF/CellData/{name}"]
        assert field.fletcher32
        chunk = field.id.get_chunk_info(field.id.get_num_chunks() - 1)
    data = bytearray(file.read_bytes())
    data[chunk.byte_offset + chunk.size // 2] ^= 1
    file.write_bytes(data)
    with h5py.File(file) as h5, pytest.raises(OSError, match="[Cc]hecksum|fletcher|filter"):
        h5[f"VTKHDF/CellData/{name}"][...]


def test_divergence_from_the_restart_file(wet: Path) -> None:
    """The last restart file gives the divergence that the last row reports."""
    with opened(wet / Run(wet).restart_files[-1]) as h5, opened(wet / "run.h5") as run_h5:
        assert h5["clock/t"][0] == run_h5["series/time"][-1]
        h = np.array([0.15 / 24, 0.1 / 16, 0.2 / 32])
        out = np.zeros((32, 16, 24))
        for d in range(3):
            flux = h5["flow/aperture"][d] * (h.prod() / h[d]) * h5["flow/uf"][d]
            flux += h5["flow/solid_flux"][d]
            flux = np.moveaxis(flux, 2 - d, 0)
            out += np.moveaxis(flux[1:] - flux[:-1], 0, 2 - d)[:32, :16, :24]
        reported = run_h5["series/divergence_max"][-1]
        assert np.abs(out).max() / h.prod() == pytest.approx(reported, rel=1e-4, abs=1e-12)


def test_dry(dry: Path) -> None:
    assert not (dry / "fields.vtkhdf").exists()
    assert (dry / "blocks.vtkhdf").exists()
    with opened(dry / "run.h5") as h5:
        for name, column in h5["series"].items():
            there = ~np.isfinite(column[:]) if name in CONTRACT["dry"] else ~np.isnan(column[:])
            assert not there.any(), name


def test_fluid_alone(fluid: Path) -> None:
    assert not (fluid / "blocks.vtkhdf").exists()
    with opened(fluid / "run.h5") as h5:
        assert h5["bodies/position"].shape == (len(h5["series/time"]), 0, 3)
        assert h5["bodies/mass"].shape == (0,)
        assert np.isfinite(h5["series/kinetic_energy_fluid"][:]).all()


def test_fluid_leaves_blocks_out(tmp_path: Path) -> None:
    """Those that a case of fluid alone names are not there, wherever they would be."""
    case = tmp_path / "case.nml"
    case.write_text(TEXTS["alone"])
    idle = " no meaning with physics = 'fluid', passed over (line "
    warning = f"mics: warning: &shape: has{idle}4)\n"
    assert run(tmp_path / "none", case=case) == (0, warning)
    case.write_text(TEXTS["alone"] + TEXTS["passed_over"])
    warning += f"mics: warning: 2 groups &body: have{idle}5)\nmics: warning: &drop: has{idle}7)\n"
    assert run(tmp_path / "some", case=case) == (0, warning)
    found = differences(tmp_path / "none", tmp_path / "some")
    assert [line for line in found if "namelist" not in line] == []


def interrupted(output: Path, act: Callable[[subprocess.Popen], object]) -> tuple[int, str]:
    """Exit code and messages of a run that is disturbed after some rows."""
    process = start(output)
    wait_for_rows(process, output, 4)
    act(process)
    said = process.communicate(timeout=60)[1]
    if process.returncode == 0:
        pytest.skip("the run was done before")
    return process.returncode, said


def goes_on(said: str, whole: Path, output: Path) -> None:
    """The command that a stopped run tells leads to the results of one that was left alone."""
    command = said.splitlines()[-1].strip()
    newest = Run(output).restart_files[-1]
    assert command == f"{MICS} --restart {output}/{newest} --threads 1 --quiet {CASE}"
    again = subprocess.run(command, shell=True, capture_output=True, timeout=300, text=True)
    assert again.returncode == 0, again.stderr
    assert but_restarts(differences(whole, output)) == []


@pytest.mark.parametrize("name", ["HUP", "INT", "USR1", "PIPE", "TERM", "XCPU"])
def test_signal(wet: Path, tmp_path: Path, name: str) -> None:
    """A run that is stopped has saved its state and goes on as if nothing had happened."""
    output, number = tmp_path / "run", signal.Signals[f"SIG{name}"]
    code, said = interrupted(output, lambda process: process.send_signal(number))
    assert code == shop.exit_status(output) == 128 + number
    goes_on(said, wet, output)


def test_inertia_that_is_cut_is_counted(wet: Path, tmp_path: Path) -> None:
    """One warning, with the time, the number and the name of the series; none for concrete."""
    (tmp_path / "cork.nml").write_text(TEXTS["cork"])
    code, said = run(tmp_path / "cork", case=tmp_path / "cork.nml")
    assert code == 0, said
    assert said.count("was cut at its limit") == said.count("warning") == 1
    assert "time(s) in the step to t = 0.01 s" in said
    assert "/series/inertia_clips of run.h5" in said
    clips = Run(tmp_path / "cork").series.inertia_clips
    assert clips[0] == 0 and (clips[1:] > 0).all()
    assert not Run(wet).series.inertia_clips.any()


@pytest.mark.parametrize(("chosen", "locked"), [(None, False), ("FALSE", False), ("TRUE", True)])
def test_locks_of_files_as_the_user_wants(tmp_path: Path, chosen: str | None, locked: bool) -> None:
    """Without a choice of the user HDF5 locks no file that a run writes."""
    settings = {k: v for k, v in os.environ.items() if k != "HDF5_USE_FILE_LOCKING"}
    if chosen:
        settings["HDF5_USE_FILE_LOCKING"] = chosen
    process = start(tmp_path / "run", case=LONG, env=settings)
    wait_for_rows(process, tmp_path / "run", 2)
    with (tmp_path / "run" / "run.h5").open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            held = False
        except BlockingIOError:
            held = True
    assert process.poll() is None
    process.terminate()
    process.communicate(timeout=60)
    assert held == locked


def test_stop_file(wet: Path, tmp_path: Path) -> None:
    """A file `stop` in the folder ends a run like SIGTERM, and does not end the next one."""
    output = tmp_path / "run"
    code, said = interrupted(output, lambda _: (output / "stop").touch())
    assert code == 143
    assert f"stopped by the file '{output}/stop', now removed" in said
    assert not (output / "stop").exists()
    goes_on(said, wet, output)


def test_stop_file_of_a_killed_run(wet: Path, tmp_path: Path) -> None:
    """One that was never read does not end the run that goes on."""
    output = tmp_path / "run"
    process = start(output)
    while not (output / "restart-a.h5").exists() and process.poll() is None:
        time.sleep(0.002)
    process.kill()
    process.communicate(timeout=60)
    (output / "stop").touch()
    code, said = run(None, "--restart", output / "restart-a.h5")
    assert code == 0, said
    assert not (output / "stop").exists()
    assert but_restarts(differences(wet, output)) == []


def test_max_wall(wet: Path, tmp_path: Path) -> None:
    """A run ends in good order before its wall time is over, and says how to go on."""
    output = tmp_path / "run"
    began = time.monotonic()
    code, said = run(output, "--max-wall", "0:00:01", case=LONG)
    assert code == 143
    assert "stopped as --max-wall asks" in said and " --max-wall 0:00:01 " in said
    assert time.monotonic() - began < 5.0
    assert list(output.glob("restart-?.h5"))


def test_reader_of_the_table_goes(tmp_path: Path) -> None:
    """`./mics case.nml | head -1` ends the run in good order."""
    output = tmp_path / "run"
    command = f"({MICS} --threads 1 --output {output} {LONG}; echo $? >&2) | head -2"
    run = subprocess.run(command, shell=True, capture_output=True, timeout=120, text=True)
    assert run.stderr.split()[-1] == "141", run.stderr
    assert list(output.glob("restart-?.h5"))


def test_how_to_go_on_with_a_case_from_standard_input(tmp_path: Path) -> None:
    output = tmp_path / "run"
    with CASE.open() as case:
        process = subprocess.Popen(
            [MICS, "--max-wall", "12:30", "--output", output], stdin=case,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        wait_for_rows(process, output, 4)
        process.terminate()
        table, said = (text.decode() for text in process.communicate(timeout=60))
    if process.returncode == 0:
        pytest.skip("the run was faster than the signal")
    assert f"{MICS} --restart {output}/restart-a.h5 --max-wall 12:30 < CASE" in said
    assert "at t = 0.0" in table  # a digit before the point


def test_older_results_are_kept(wet: Path, tmp_path: Path) -> None:
    output = tmp_path / "run"
    for _ in range(3):
        code, said = run(output, case=CASES / "ranks" / "dry.nml")
        assert code == 0, said
    assert said == f"mics: the older results in {output} are kept as {output}.bak-2\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run", "run.bak-1", "run.bak-2"]


@pytest.mark.parametrize("option", ["--quiet", "--check"])
def test_other_folders_are_refused(option: str, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("important")
    code, said = run(tmp_path, option)
    assert code == 2
    assert f"--output = '{tmp_path}': the folder is not empty" in said
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def short_case(path: Path, values: str, size: float = 0.1) -> Path:
    """A dry case of some steps."""
    path.write_text(TEXTS["short"].format(values=values, size=size))
    return path


def test_blanks_at_the_end_of_a_name(tmp_path: Path) -> None:
    case = short_case(tmp_path / "case.nml", "t_end = 0.02  output = 'a b  '")
    assert run(None, case=case, cwd=tmp_path) == (0, "")
    assert (tmp_path / "a b" / "run.h5").is_file()


def test_run_shorter_than_a_step(tmp_path: Path) -> None:
    """Of a case that is longer than the 64 kB of a plain attribute."""
    case = short_case(tmp_path / "case.nml", "t_end = 0.004")
    case.write_text(case.read_text() + 9000 * "! a remark\n")
    assert run(tmp_path / "run", case=case) == (0, "")
    with opened(tmp_path / "run" / "run.h5") as h5:
        assert h5["series/time"][:].tolist() == [0.0, 0.004]
        assert h5["provenance"].attrs["namelist"] == case.read_text()


@pytest.mark.parametrize("interval", ["1e-20", "1e-13", "1e-11", "0.01"])
def test_interval_shorter_than_a_step(interval: str, tmp_path: Path) -> None:
    """A row for each step, however short the interval."""
    values = f"t_end = 0.05  history_interval = {interval}  restart_interval = {interval}"
    case = short_case(tmp_path / "case.nml", values)
    process = start(tmp_path / "run", case=case)
    try:
        assert process.wait(timeout=20) == 0
    finally:
        process.kill()
    assert len(Run(tmp_path / "run").series.time) == 6


def test_same_folder_by_another_name(tmp_path: Path) -> None:
    """A run goes on in its folder, whatever way leads there."""
    case = short_case(tmp_path / "case.nml", "t_end = 0.02  output = 'run'")
    assert run(None, case=case, cwd=tmp_path) == (0, "")
    (tmp_path / "link").symlink_to("run")
    for n, name in enumerate(["run", str(tmp_path / "run"), "./run/", "link"]):
        short_case(case, f"t_end = {0.04 + 0.02 * n}  output = 'run'")
        there = ["--restart", "./run/restart-a.h5", "--output", name]
        assert run(None, *there, case=case, cwd=tmp_path) == (0, "")
    assert Run(tmp_path / "run").series.time[-1] == 0.1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.nml", "link", "run"]


def test_every_change_of_a_case_is_told(tmp_path: Path) -> None:
    settled = "t_end = 0.02  stop_when_settled = .true."
    case = short_case(tmp_path / "case.nml", settled)
    assert run(tmp_path / "run", case=case) == (0, "")
    short_case(case, f"{settled}  rest_time = 3", size=0.2)
    code, said = run(None, "--restart", tmp_path / "run" / "restart-a.h5", case=case)
    assert code == 2
    assert "&run rest_time = 3, was rest_time = 0.5; &shape size = 0.2, was size = 0.1" in said
    case.write_text(case.read_text() + "&body shape = 'a'  position = 0.2, 0.2, 0.2 /")
    code, said = run(None, "--restart", tmp_path / "run" / "restart-a.h5", case=case)
    assert code == 2
    assert said.endswith("; &body, was nothing\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_no_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    code, said = run(tmp_path / "run")
    tmp_path.chmod(0o700)
    assert code == 4, said


def test_damaged_restart(wet: Path, tmp_path: Path) -> None:
    """With a bit flipped anywhere it is refused, unless nobody needs that bit."""
    path, whole, refused = tmp_path / "restart-a.h5", (wet / "restart-a.h5").read_bytes(), 0
    for at in range(len(whole) // 20, len(whole), len(whole) // 10):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 16]) + whole[at + 1 :])
        code, said = run(tmp_path / f"copy{at}", "--restart", path)
        assert code in (0, 4), said
        refused += code == 4
        assert code == 4 or but_restarts(differences(wet, tmp_path / f"copy{at}")) == []
        shutil.rmtree(tmp_path / f"copy{at}", ignore_errors=True)
    assert refused > 5


def test_changed_case(wet: Path, tmp_path: Path) -> None:
    """t_end may be raised, to what lies ahead, and intervals may change."""
    other = tmp_path / "other.nml"
    other.write_text(CASE.read_text().replace("t_end = 0.08", "t_end = 0.01"))
    code, said = run(tmp_path / "copy", "--restart", wet / "restart-b.h5", case=other)
    assert (code, "&run t_end: the restart file is already past it" in said) == (2, True)
    longer = CASE.read_text().replace("t_end = 0.08", "t_end = 0.09")
    other.write_text(longer.replace("field_interval = 0.02", "field_interval = 0.01"))
    shutil.copytree(wet, tmp_path / "longer")
    newest = Run(wet).restart_files[-1]
    code, said = run(None, "--restart", tmp_path / "longer" / newest, case=other)
    assert code == 0, said
    found = Run(tmp_path / "longer")
    assert found.series.time[-1] == 0.09 and np.all(np.diff(found.series.time) > 0)
    assert "t_end = 0.09" in found.provenance["namelist"]
