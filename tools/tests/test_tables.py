"""A run for pandas and xarray: rows and fields with names and units, read when they are wanted."""

import numpy as np
import pytest

from micstools import Run
from synthetic import Motion


def test_blocks_as_a_table(loose_pile: Run) -> None:
    b, found = loose_pile.bodies, loose_pile.blocks
    assert len(found) == b.n * len(b.time)
    row = found[(found.block == 4) & (found.time == b.time[5])].iloc[0]
    assert row[["x", "y", "z"]].tolist() == b.position[5, 3].tolist()
    assert row["contact_ty"] == b.contact_torque[5, 3, 1] and row["shape"] == b.shape[3]
    assert row["released"] == int(b.present(5)[3])
    last = found.groupby("block").last()
    assert last.z.to_numpy() == pytest.approx(b.position[-1, :, 2])
    units = found.attrs["units"]
    assert (units["x"], units["vx"], units["fluid_tz"]) == ("m", "m/s", "N m")


def test_places_as_a_table(loose_pile: Run) -> None:
    found = loose_pile.places
    assert list(found.columns) == list(found.attrs["meaning"])
    assert found.z.to_numpy() == pytest.approx(loose_pile.bodies.position[-1, :, 2])


def test_fields_have_named_axes_and_units(loose_pile: Run) -> None:
    found, cells = loose_pile.fields, loose_pile.grid.centres
    assert found.liquid.dims == ("time", "z", "y", "x")
    assert found.velocity.dims == ("time", "z", "y", "x", "component")
    assert (found.pressure.attrs["units"], found.x.attrs["units"]) == ("Pa", "m")
    assert found.x.to_numpy() == pytest.approx(cells[0])
    one = loose_pile.fields_at(2.0)
    then = found.sel(time=2.0)
    assert (then.liquid.to_numpy() == one.liquid).all()
    assert (then.velocity.sel(component="z").to_numpy() == one.velocity[..., 2]).all()
    level = float(then.liquid.sel(x=0.1, y=0.05, method="nearest").sum("z")) * 0.005
    assert level == pytest.approx(one.liquid[:, 10, 20].sum() * 0.005, rel=0.05)


def test_fields_are_read_when_wanted(loose_pile: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mean over one time reads that time alone."""
    run = Run(loose_pile.folder)
    found, asked, frame = run.fields, [], run.frame
    assert "dask" in type(found.liquid.data).__module__
    monkeypatch.setattr(run, "frame", lambda *words: asked.append(words) or frame(*words))
    assert float(found.solid.isel(time=3).mean()) == pytest.approx(
        float(run.fields_at(run.field_times[3]).solid.mean()), rel=1e-5
    )
    assert asked == [("solid", 3)]
    assert found.solid.mean(("x", "y", "z")).to_numpy().shape == run.field_times.shape


def test_a_run_without_fields(make_run) -> None:
    run = make_run(Motion(t_end=1.0))
    (run.folder / "fields.vtkhdf").unlink()
    assert list(run.fields.data_vars) == [] and run.fields.sizes["time"] == 0


def test_a_run_is_shown(loose_pile: Run) -> None:
    assert repr(loose_pile) == str(loose_pile)
    shown = loose_pile._repr_html_()
    assert shown.startswith("<pre>") and "heading_deg" in shown
    assert np.char.count(shown, "<tr") >= loose_pile.bodies.n
