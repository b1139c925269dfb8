"""What a verification case finds: quantities against their reference and band, curves, and errors
against resolution. A case's `check.py` fills a `Checks`; pytest and the report read it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from measures.balance import uneven_divergence
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array

DRIFT_BAND = 1e-9  # of the liquid volume

Curves = Mapping[str, tuple[ArrayLike, ArrayLike]]


@dataclass(frozen=True)
class Result:
    """One quantity of a case."""

    quantity: str
    ours: str
    reference: str
    error: str
    band: str
    holds: bool
    counts: bool = True  # False: for information, may miss
    known: str = ""  # why it is known to miss

    @property
    def mark(self) -> str:
        """In one word."""
        if not self.counts:
            return "(holds)" if self.holds else "(misses)"
        return "ok" if self.holds else "misses" if self.known else "FAILED"


@dataclass(frozen=True)
class Figure:
    """Curves of ours (lines) and of the reference (dots, or lines where `smooth`) over one axis."""

    title: str
    x: str
    y: str
    ours: dict[str, tuple[Array, Array]]
    reference: dict[str, tuple[Array, Array]]
    smooth: bool = False


@dataclass(frozen=True)
class Study:
    """A quantity at several resolutions."""

    quantity: str
    resolution: str  # what `cells` counts
    cells: tuple[float, ...]  # rising
    values: tuple[float, ...]
    reference: float  # nan: none, the order comes from the differences of successive values

    @property
    def errors(self) -> tuple[float, ...]:
        """Error of each value: against the reference, relative; without one, against the finest."""
        true = self.reference if np.isfinite(self.reference) else self.values[-1]
        scale = abs(true) if true else 1.0
        return tuple((value - true) / scale for value in self.values)

    @property
    def orders(self) -> tuple[float, ...]:
        """Observed order between successive grids; without a reference, from successive
        differences of three grids (Richardson), one less."""
        if np.isfinite(self.reference):
            gaps, cells = np.abs(self.errors), np.array(self.cells)
        else:
            gaps, cells = np.abs(np.diff(self.values)), np.array(self.cells[:-1])
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.log(gaps[:-1] / gaps[1:]) / np.log(cells[1:] / cells[:-1])
        return tuple(float(order) for order in found)


@dataclass
class Checks:
    """Collects results, figures and studies; prints them, and knows whether all of them hold."""

    title: str
    results: list[Result] = field(default_factory=list)
    routine: list[Result] = field(default_factory=list)  # what holds in any case, see `sound`
    _figures: dict[str, Figure] = field(default_factory=dict)
    _points: dict[str, tuple[str, float, dict[float, float]]] = field(default_factory=dict)

    @property
    def failed(self) -> int:
        """How many results that count miss and are not known to; one if the case has none."""
        missing = [r for r in self.results + self.routine if r.counts and not (r.holds or r.known)]
        return len(missing) if any(r.counts for r in self.results) else 1

    def know(self, misses: Mapping[str, str]) -> None:
        """Note why results are known to miss, by parts of their quantities."""
        for k, r in enumerate(self.results):
            why = [words for part, words in misses.items() if part in r.quantity]
            self.results[k] = replace(r, known="; ".join(why))

    def close(
        self, quantity: str, ours: float, reference: float, band: float, counts: bool = True
    ) -> None:
        """`ours` must lie within the relative `band` around `reference`."""
        holds = abs(ours - reference) <= band * abs(reference)
        error = (ours - reference) / abs(reference) if reference else float(ours)
        text = f"{100 * error:+.3g} %" if abs(error) > 1e-4 else f"{error:+.1e}"
        wide = f"±{100 * band:g} %" if band >= 1e-4 else f"±{band:.0e} of it"
        self._add(quantity, ours, f"{reference:.7g}", text, wide, holds, counts)

    def within(
        self, quantity: str, ours: float, low: float, high: float, counts: bool = True
    ) -> None:
        """`ours` must lie between two bounds."""
        past = min(ours - low, 0.0) + max(ours - high, 0.0)
        error = f"{past:+.2g}" if past else "0"
        bounds = f"{low:.5g} to {high:.5g}"
        self._add(quantity, ours, bounds, error, "inside", low <= ours <= high, counts)

    def below(self, quantity: str, ours: float, limit: float, counts: bool = True) -> None:
        """The size of `ours` must not exceed `limit`."""
        self._add(quantity, ours, "0", f"{ours:+.1e}", f"< {limit:g}", abs(ours) < limit, counts)

    def true(self, quantity: str, holds: bool, figures: str = "", counts: bool = True) -> None:
        """A statement that must hold."""
        holds = bool(holds)
        self.results.append(Result(quantity, figures or str(holds), "", "", "", holds, counts))

    def figure(self, title: str, x: str, y: str, ours: Curves, reference: Curves | None = None,
               smooth: bool = False) -> None:  # fmt: skip
        """Draw curves, named x and y values, of ours and of the reference, in one picture for each
        title."""

        def arrays(curves: Curves) -> dict[str, tuple[Array, Array]]:
            pairs = curves.items()
            return {name: (np.asarray(a, float), np.asarray(b, float)) for name, (a, b) in pairs}

        if title not in self._figures:
            self._figures[title] = Figure(title, x, y, {}, {}, smooth)
        self._figures[title].ours.update(arrays(ours))
        self._figures[title].reference.update(arrays(reference or {}))

    @property
    def figures(self) -> list[Figure]:
        """In the order of their first curves."""
        return list(self._figures.values())

    def study(
        self,
        quantity: str,
        values: Mapping[float, float],
        reference: float = float("nan"),
        resolution: str = "cells",
    ) -> None:
        """A quantity over the number of cells, of one run or of several; draws the errors and finds
        the observed order."""
        known = self._points.setdefault(quantity, (resolution, reference, {}))
        known[2].update(values)

    @property
    def studies(self) -> list[Study]:
        """Those of at least two resolutions."""
        found = []
        for quantity, (resolution, reference, values) in self._points.items():
            cells = tuple(sorted(values))
            at = tuple(values[n] for n in cells)
            found += [Study(quantity, resolution, cells, at, reference)] if len(cells) > 1 else []
        return found

    def text(self) -> str:
        """The tables."""
        heads = ("quantity", "ours", "reference", "error", "band", "")
        rows = [
            (r.quantity, r.ours, r.reference, r.error, r.band, r.mark)
            for r in self.results + self.routine
        ]
        widths = [max(len(row[k]) for row in [heads, *rows]) for k in range(6)]
        lines = [self.title]
        for row in [heads, *rows]:
            cells = zip(row, widths, strict=True)
            lines.append("  " + "  ".join(cell.ljust(width) for cell, width in cells).rstrip())
        if not any(r.counts for r in self.results):
            lines.append("  nothing was checked")
        for s in self.studies:
            lines.append(f"  {s.quantity} over {s.resolution}:")
            errors = zip(s.cells, s.values, s.errors, strict=True)
            lines += [f"    {c:g}: {v:.6g} ({100 * e:+.3g} %)" for c, v, e in errors]
            lines.append(f"    observed order: {', '.join(f'{p:.2f}' for p in s.orders) or '-'}")
        return "\n".join(lines)

    def _add(self, quantity: str, ours: float, reference: str, error: str, band: str,
             holds: bool, counts: bool) -> None:  # fmt: skip
        holds = bool(holds) and bool(np.isfinite(ours))
        self.results.append(Result(quantity, f"{ours:.7g}", reference, error, band, holds, counts))


def sound(run: Run, checks: Checks) -> None:
    """What has to hold in every run: a good end, divergence below its tolerance at every row and
    in the saved faces (which `coupling = 'mics'` does not claim), and the liquid kept."""
    here, found = run.folder.name, Checks(checks.title)
    _sound(run, here, found)
    checks.routine += found.results


def _sound(run: Run, here: str, checks: Checks) -> None:
    checks.true(f"{here}: exit status 0", int(run.provenance.get("exit_status", -1)) == 0)
    if not run.field_times.size and not run.restart_files:
        return
    if run.value("run", "physics") == "dry":
        return
    tolerance = float(run.value("numerics", "divergence_tolerance"))
    claims = run.value("numerics", "coupling") == "monolithic"
    largest = float(run.series.divergence_max[1:].max())
    checks.below(f"{here}: largest divergence of all rows [1/s]", largest, tolerance, claims)
    drift = float(np.abs(run.series.liquid_volume_drift).max())
    checks.below(f"{here}: largest drift of the liquid of all rows", drift, DRIFT_BAND)
    for name in run.restart_files:
        worst = float(np.abs(uneven_divergence(run, run.restart(name))).max())
        said = f"{here}: divergence from the faces in {name} [1/s]"
        checks.below(said, worst, tolerance, claims)
