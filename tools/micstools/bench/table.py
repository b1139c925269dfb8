"""The bench as a table, and beside an older one."""

import json
from pathlib import Path
from typing import Any

from micstools.bench.parts import KEYS, Row
from micstools.reading.reader import BadRun

HEAD = (
    f"{'part':9}{'job':12}{'crew':>6}{'size':>9}{'steps':>7}{'wall s':>10}{'CPU s':>10}"
    f"{'slowest':>9}  "
)


def line(row: Row) -> str:
    """One row."""
    crew = f"{row['threads']}t" if row["ranks"] == 1 else f"{row['ranks']}r"
    spread = f"{row['spread']:+.0%}" if "spread" in row else ""
    return (
        f"{row['part']:9}{row['job']:12}{crew:>6}{row['size']:9}{row['steps']:7}"
        f"{row['wall']:10.4g}{row['cpu']:10.4g}{spread:>9}  {_more(row)}"
    )


def _more(row: Row) -> str:
    """What only some rows have."""
    words = []
    if "ns" in row:
        words.append(f"{row['ns']:.0f} ns each")
    if row["part"] in ("jobs", "whole") and "step_ms" in row:
        words.append(f"{row['step_ms']:.1f} ms a step")
        words.append(f"{row['simulated'] / row['wall']:.3g} s a s")
    if row["part"] == "growth" and "step_ms" in row:
        words.append(f"{1e6 * row['step_ms'] / row['size']:.0f} ns a step")
    if row["part"] == "growth":
        words.append(f"{row['memory_each']:.4g} bytes each")
    if "depth_mm" in row:
        words.append(f"{row['depth_mm']:.2f} mm deep")
    return ", ".join(words)


def read(path: Path) -> dict[str, Any]:
    """A bench that was written."""
    try:
        found: dict[str, Any] = json.loads(path.read_text())
        _by_key(found["rows"])
    except (ValueError, KeyError, TypeError) as error:
        raise BadRun(f"{path} is no bench of this form ({error!r})") from error
    return found


def _by_key(rows: list[Row]) -> dict[tuple[Any, ...], Row]:
    return {tuple(row[k] for k in KEYS): row for row in rows}


def beside(new: dict[str, Any], old: dict[str, Any]) -> str:
    """How many times the older wall and CPU time, and steps, each row of the new one takes."""
    lines = [f"times what {old['version']} took"]
    if new["processor"] != old["processor"]:
        lines.append(f"on another processor, {old['processor']}: the ratios say little")
    before = _by_key(old["rows"])
    for key, row in _by_key(new["rows"]).items():
        if key not in before:
            lines.append(f"{line(row)[:43]} new")
            continue
        was = before.pop(key)
        ratios = [f"{k} {row[k] / was[k]:.2f}" for k in ("wall", "cpu", "steps") if was.get(k)]
        lines.append(f"{line(row)[:43]} {', '.join(ratios)}")
    lines += [f"{line(row)[:43]} not in this one" for row in before.values()]
    return "\n".join(lines)
