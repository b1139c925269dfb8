"""Diagrams of a run with matplotlib; every function returns a figure or writes one file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from micstools.pictures.scene import DROPPED
from micstools.reading import health, kicks, scales, units
from micstools.reading.health import EXCESS_LIMIT
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

MANY = 32  # blocks that have a line of their own in the legend
DASHES = ("-", "--", ":", "-.")


@dataclass(frozen=True)
class Panel:
    """A diagram against time."""

    title: str
    lines: tuple[tuple[Array, str, str, str], ...] = ()  # values (T), colour, dashes, name
    blocks: Array | None = None  # (T, N) a line for each dropped block
    limit: float | None = None  # to compare with
    linear: float | None = None  # of a logarithmic axis the part that is linear, 0: none
    zero: bool = False  # the axis begins there


def _panels(run: Run) -> list[Panel]:
    """Heights, speeds, forces, liquid, energies and the work of the solver."""
    b, s, found = run.bodies, run.series, list[Panel]()
    shown, red, blue, violet = units.of_run(run), "#d1495b", "#00798c", "#6a4c93"
    force, length = shown.force, shown.length
    if b.dropped.size:
        heights, speeds = length.of(b.position[..., 2]), np.linalg.norm(b.velocity, axis=2)
        found.append(Panel(f"height of the centroid, z [{length.name}]", blocks=heights))
        found.append(Panel("speed [m/s]", blocks=speeds))
    if b.n and run.field_times.size:
        vertical = force.of(b.fluid_force[..., 2])
        found.append(Panel(f"vertical force of the fluid [{force.name}]", blocks=vertical))
    if b.n:
        blows, share = np.linalg.norm(b.contact_force, axis=2), s.max_overlap / scales.smallest(run)
        found.append(Panel(f"contact force [{force.name}]", blocks=force.of(blows), zero=True,
                           linear=force.of(scales.weight(run)) or 1.0))  # fmt: skip
        found.append(Panel("largest overlap [% of the smallest block's length]",
                           ((100 * share, "#2e4057", "-", ""),)))  # fmt: skip
        untouched = kicks.acceleration(run)
        if np.isfinite(untouched).any():
            title = "acceleration of untouched blocks under water [g], limit dashed"
            found.append(Panel(title, blocks=untouched, limit=kicks.LIMIT, zero=True))
    if np.isfinite(s.liquid_volume).any():
        drift, limit = s.liquid_volume_drift, health.divergence_limit(run)
        found.append(Panel("drift of the liquid volume [-]", ((drift, blue, "-", ""),)))
        curve = (_positive(s.divergence_max), blue, "-", "")
        title = "largest divergence [1/s], tolerance dashed"
        found.append(Panel(title, (curve,), limit=limit, linear=0.0))
    if np.isfinite(s.volume_excess_max).any():
        curve = (_positive(s.volume_excess_max), blue, "-", "")
        title = "largest excess of fluid in a cell [V], limit dashed"
        found.append(Panel(title, (curve,), limit=EXCESS_LIMIT, linear=0.0))
    energies = (
        (s.kinetic_energy_bodies, red, "-", "kinetic, blocks"),
        (s.kinetic_energy_fluid, blue, "--", "kinetic, fluid"),
        (s.contact_energy, "#edae49", ":", "contact"),
    )
    told = tuple((shown.energy.of(values), *look) for values, *look in energies
                 if np.isfinite(values).any() and np.nanmax(np.abs(values)) > 0)  # fmt: skip
    found.append(Panel(f"energy [{shown.energy.name}]", told))
    steps = np.where(s.time > s.time[0], 1e3 * s.dt, np.nan)
    found.append(Panel("time step [ms]", ((steps, violet, "-", ""),), zero=True))
    if np.isfinite(s.solver_iterations).any():
        work = ((s.solver_iterations, violet, "-", "iterations"),
                (s.pressure_passes, "#edae49", "-", "pressure passes"))  # fmt: skip
        found.append(Panel("pressure solver, per step", work))
    return found


def _draw(axis: Axes, run: Run, panel: Panel) -> None:
    if panel.blocks is not None:
        _each_block(axis, run, panel.blocks)
    for values, colour, dashes, name in panel.lines:
        axis.plot(run.series.time, values, color=colour, ls=dashes, lw=0.8, label=name or None)
    if panel.limit is not None:
        axis.axhline(panel.limit, color="#d1495b", lw=0.8, ls="--")
    if panel.linear is not None:
        kind: dict[str, Any] = {"linthresh": panel.linear} if panel.linear else {}
        axis.set_yscale("symlog" if panel.linear else "log", **kind)
    if any(name for *_, name in panel.lines):  # beside the title, where no curve runs
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=7,
                    frameon=False, borderpad=0)  # fmt: skip
    if panel.zero:
        axis.set_ylim(bottom=0)
    axis.set_title(panel.title, loc="left")


def history(run: Run) -> Figure:
    """Heights, speeds, forces, liquid, energies and the work of the solver against time."""
    matplotlib.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.grid": True})
    matplotlib.rcParams.update(
        {"grid.alpha": 0.3, "axes.spines.top": False, "text.parse_math": False}
    )
    panels = _panels(run)
    rows = (len(panels) + 1) // 2
    figure = Figure(figsize=(11, 2.4 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False).ravel()
    for axis, panel in zip(axes, panels, strict=False):
        _draw(axis, run, panel)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    for axis in axes[max(0, len(panels) - 2) : len(panels)]:
        axis.set_xlabel("time [s]")
        axis.tick_params(labelbottom=True)
    title = run.value("run", "title") or run.folder.name
    figure.suptitle(f"{title} ({run.note})" if run.note else title)
    _name_blocks(figure, list(axes), run)
    return figure


def _each_block(axis: Axes, run: Run, values: Array) -> None:
    """One line per dropped block, from its release on; `values` (T, N).

    Blocks have their colour of the pictures; the dashes, too, differ from one to the next, and with
    both of them 32 blocks can be told apart, four without colours.
    """
    time = run.bodies.time
    for order, k in enumerate(run.bodies.dropped):
        here = (time >= run.bodies.entry_time[k] - 1e-12) & (time <= run.bodies.exit_time[k])
        axis.plot(
            time[here],
            values[here, k],
            color=DROPPED[order % len(DROPPED)],
            ls=DASHES[(order + order // len(DROPPED)) % len(DASHES)],
            lw=1,
            label=f"{k + 1}",
        )


def _name_blocks(figure: Figure, axes: list[Axes], run: Run) -> None:
    """One legend of the blocks below all panels, over no curve; the numbers are those of the case,
    from 1."""
    lines = axes[0].get_legend_handles_labels()[0] if run.bodies.dropped.size else []
    if not lines:
        return
    title = "block" if len(lines) <= MANY else f"block, the first {MANY} of {len(lines)}"
    figure.legend(
        handles=lines[:MANY],
        title=title,
        loc="outside lower center",
        ncols=min(len(lines), MANY // 2),
        fontsize=7,
        title_fontsize=7,
        handlelength=2.4,
        columnspacing=1.2,
    )


def _positive(values: Array) -> Array:
    """Values for a logarithmic axis: what is not positive is left out."""
    return np.where(np.asarray(values, float) > 0, values, np.nan)


def contact_sheet(pictures: list[Path], path: Path, columns: int, width: int = 420) -> Path:
    """All pictures, made small, on one sheet; the rows have the height of their tallest picture."""
    small = []
    for picture in pictures:
        with Image.open(picture) as full:
            size = (width, round(full.height * width / full.width))
            small.append(full.convert("RGB").resize(size, Image.Resampling.LANCZOS))
    rows = [small[k : k + columns] for k in range(0, len(small), columns)]
    heights = [max(image.height for image in row) for row in rows]
    sheet = Image.new("RGB", (columns * width, sum(heights)), "white")
    top = 0
    for row, height in zip(rows, heights, strict=True):
        for column, image in enumerate(row):
            sheet.paste(image, (column * width, top))
        top += height
    sheet.save(path)
    return path
