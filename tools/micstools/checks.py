"""A table of quantities against their reference and band; the end of every `check.py`."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from micstools.balance import divergence
from micstools.reader import Run

DRIFT_BAND = 1e-9  # of the liquid volume


@dataclass
class Checks:
    """Collects rows, prints them, and knows whether all of them hold."""

    title: str
    failed: int = 0
    rows: list[tuple[str, str, str, str, str]] = field(default_factory=list)

    def close(self, quantity: str, ours: float, reference: float, band: float) -> None:
        """`ours` must lie within the relative `band` around `reference`."""
        holds = abs(ours - reference) <= band * abs(reference)
        self._add(quantity, ours, f"{reference:.7g}", f"+-{band:.1e} of it", holds)

    def below(self, quantity: str, ours: float, limit: float) -> None:
        """The size of `ours` must not exceed `limit`."""
        self._add(quantity, ours, "0", f"|.| < {limit:.1e}", abs(ours) < limit)

    def true(self, quantity: str, holds: bool, figures: str = "") -> None:
        """A statement that must hold."""
        self.rows.append((quantity, figures or str(holds), "", "", self._mark(holds)))

    def report(self) -> int:
        """Print the table; 0 when every row holds, else 1."""
        heads = ("quantity", "ours", "reference", "band", "")
        widths = [max(len(row[k]) for row in [heads, *self.rows]) for k in range(5)]
        print(self.title)
        for row in [heads, *self.rows]:
            cells = zip(row, widths, strict=True)
            print("  " + "  ".join(cell.ljust(width) for cell, width in cells).rstrip())
        if not self.rows:
            print("  nothing was checked")
        return int(self.failed > 0 or not self.rows)

    def _add(self, quantity: str, ours: float, reference: str, band: str, holds: bool) -> None:
        holds = bool(holds) and bool(np.isfinite(ours))
        self.rows.append((quantity, f"{ours:.7g}", reference, band, self._mark(holds)))

    def _mark(self, holds: bool) -> str:
        self.failed += not holds
        return "ok" if holds else "FAILED"


def sound(run: Run, checks: Checks) -> None:
    """What has to hold in every run: a good end, divergence below its tolerance at every row and
    in the saved faces, and the liquid kept."""
    here = run.folder.name
    checks.true(f"{here}: exit status 0", int(run.provenance.get("exit_status", -1)) == 0)
    if not run.field_times.size and not run.restart_files:
        return
    tolerance = float(run.value("numerics", "divergence_tolerance", 1e-6))
    rows = run.series.divergence_max[1:]
    checks.below(f"{here}: largest divergence of all rows [1/s]", float(rows.max()), tolerance)
    drift = float(np.abs(run.series.liquid_volume_drift).max())
    checks.below(f"{here}: largest drift of the liquid of all rows", drift, DRIFT_BAND)
    for name in run.restart_files:
        worst = float(np.abs(divergence(run, run.restart(name))).max())
        checks.below(f"{here}: divergence from the faces in {name} [1/s]", worst, tolerance)


def main(check: Callable[[list[Run]], Checks]) -> None:
    """Run a check on the result folders given on the command line and exit with its verdict."""
    if len(sys.argv) < 2:
        print(f"usage: {sys.argv[0]} RUN [RUN ...]", file=sys.stderr)
        raise SystemExit(2)
    raise SystemExit(check([Run(folder) for folder in sys.argv[1:]]).report())
