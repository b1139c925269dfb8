"""Diagrams of a run with matplotlib; every function returns a figure or writes one file."""

from collections.abc import Callable
from pathlib import Path

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

Panel = Callable[[Axes, Run], None]


def history(run: Run) -> Figure:
    """Heights, speeds, forces, liquid, energies and the work of the solver against time."""
    matplotlib.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.grid": True})
    matplotlib.rcParams.update({"grid.alpha": 0.3, "axes.spines.top": False})
    panels: list[Panel] = []
    if run.bodies.dropped.size:
        panels += [_heights, _speeds]
    if run.bodies.n:
        panels += [_fluid_force, _contact_force] if run.field_times.size else [_contact_force]
        panels += [_overlap]
        if np.isfinite(kicks.acceleration(run)).any():
            panels += [_untouched]
    if np.isfinite(run.series.liquid_volume).any():
        panels += [_liquid, _divergence]
    if np.isfinite(run.series.volume_excess_max).any():
        panels.append(_excess)
    panels += [_energies, _steps]
    if np.isfinite(run.series.solver_iterations).any():
        panels.append(_solver)
    rows = (len(panels) + 1) // 2
    figure = Figure(figsize=(11, 2.4 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False).ravel()
    for axis, panel in zip(axes, panels, strict=False):
        panel(axis, run)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    for axis in axes[max(0, len(panels) - 2) : len(panels)]:
        axis.set_xlabel("time [s]")
        axis.tick_params(labelbottom=True)
    title = run.value("run", "title") or run.folder.name
    figure.suptitle(f"{title} ({run.note})" if run.note else title)
    _name_blocks(figure, list(axes), run)
    return figure


def _each_block(axis: Axes, run: Run, values: Array, title: str) -> None:
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
    axis.set_title(title, loc="left")


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


def _legend_above(axis: Axes) -> None:
    """The legend of a panel beside its title, where no curve runs."""
    axis.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=3,
        fontsize=7,
        frameon=False,
        borderpad=0,
    )


def _heights(axis: Axes, run: Run) -> None:
    length = units.of_run(run).length
    height = length.of(run.bodies.position[..., 2])
    _each_block(axis, run, height, f"height of the centroid, z [{length.name}]")


def _speeds(axis: Axes, run: Run) -> None:
    _each_block(axis, run, np.linalg.norm(run.bodies.velocity, axis=2), "speed [m/s]")


def _fluid_force(axis: Axes, run: Run) -> None:
    unit = units.of_run(run).force
    force = unit.of(run.bodies.fluid_force[..., 2])
    _each_block(axis, run, force, f"vertical force of the fluid [{unit.name}]")


def _contact_force(axis: Axes, run: Run) -> None:
    unit = units.of_run(run).force
    force = unit.of(np.linalg.norm(run.bodies.contact_force, axis=2))
    _each_block(axis, run, force, f"contact force [{unit.name}]")
    axis.set_yscale("symlog", linthresh=unit.of(scales.weight(run)) or 1.0)
    axis.set_ylim(bottom=0)


def _untouched(axis: Axes, run: Run) -> None:
    title = "acceleration of untouched blocks under water [g], limit dashed"
    _each_block(axis, run, kicks.acceleration(run), title)
    axis.axhline(kicks.LIMIT, color="#d1495b", lw=0.8, ls="--")
    axis.set_ylim(bottom=0)


def _overlap(axis: Axes, run: Run) -> None:
    share = 100 * run.series.max_overlap / scales.smallest(run)
    axis.plot(run.series.time, share, color="#2e4057", lw=0.8)
    axis.set_title("largest overlap [% of the smallest block's length]", loc="left")


def _liquid(axis: Axes, run: Run) -> None:
    axis.plot(run.series.time, run.series.liquid_volume_drift, color="#00798c", lw=0.8)
    axis.set_title("drift of the liquid volume [-]", loc="left")


def _excess(axis: Axes, run: Run) -> None:
    axis.semilogy(run.series.time, _positive(run.series.volume_excess_max), color="#00798c", lw=0.8)
    axis.axhline(EXCESS_LIMIT, color="#d1495b", lw=0.8, ls="--")
    axis.set_title("largest excess of fluid in a cell [V], limit dashed", loc="left")


def _divergence(axis: Axes, run: Run) -> None:
    axis.semilogy(run.series.time, _positive(run.series.divergence_max), color="#00798c", lw=0.8)
    axis.axhline(health.divergence_limit(run), color="#d1495b", lw=0.8, ls="--")
    axis.set_title("largest divergence [1/s], tolerance dashed", loc="left")


def _energies(axis: Axes, run: Run) -> None:
    s, unit = run.series, units.of_run(run).energy
    for values, label, colour, dashes in (
        (s.kinetic_energy_bodies, "kinetic, blocks", "#d1495b", "-"),
        (s.kinetic_energy_fluid, "kinetic, fluid", "#00798c", "--"),
        (s.contact_energy, "contact", "#edae49", ":"),
    ):
        if np.isfinite(values).any() and np.nanmax(np.abs(values)) > 0:
            axis.plot(s.time, unit.of(values), color=colour, ls=dashes, lw=1, label=label)
    _legend_above(axis)
    axis.set_title(f"energy [{unit.name}]", loc="left")


def _steps(axis: Axes, run: Run) -> None:
    axis.plot(run.series.time[1:], 1e3 * run.series.dt[1:], color="#6a4c93", lw=0.8)
    axis.set_ylim(bottom=0)
    axis.set_title("time step [ms]", loc="left")


def _solver(axis: Axes, run: Run) -> None:
    s = run.series
    axis.plot(s.time, s.solver_iterations, color="#6a4c93", lw=0.6, label="iterations")
    axis.plot(s.time, s.pressure_passes, color="#edae49", lw=0.8, label="pressure passes")
    _legend_above(axis)
    axis.set_title("pressure solver, per step", loc="left")


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
