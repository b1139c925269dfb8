"""The report of `make verify`: one HTML page that needs nothing else, and report.json."""

import base64
import html
import io
import json
import math
import re
import sys
from dataclasses import asdict, dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import numpy as np  # noqa: E402
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.ticker import LogLocator, MaxNLocator  # noqa: E402

from measures.checks import Checks, Figure, Result, Study  # noqa: E402
from micstools.reading.reader import Run  # noqa: E402

CASES = Path(__file__).resolve().parent / "cases"
OURS = ("#0b5394", "#c55a11", "#38761d", "#741b47", "#7f6000", "#134f5c")
THEIRS = ("#222222", "#888888", "#aa6666", "#66aa66")
OPTIONS = ("numerics", "contact")


@dataclass(frozen=True)
class Finished:
    """How a run ended."""

    name: str
    folder: str
    seconds: float
    ended: str

    @property
    def good(self) -> bool:
        """The run reached its end."""
        return self.ended == "code 0"


@dataclass
class Case:
    """A case, its runs and what its check found."""

    name: str
    varies: tuple[str, ...]  # options, like 'numerics coupling', that this case is about
    runs: list[Finished]
    left_out: list[str]  # runs that cost more than this level allows
    checks: Checks | None = None
    problem: str = ""
    options: dict[str, list[str]] = field(default_factory=dict)  # by run, other than the defaults
    strange: list[str] = field(default_factory=list)  # options that differ without being declared

    @property
    def verdict(self) -> str:
        """In one word; `not run` only if nothing was."""
        if (
            self.problem
            or self.strange
            or any(run.ended.startswith("code ") and not run.good for run in self.runs)
        ):
            return "miss"
        if self.checks is None:
            return "not run"
        if self.checks.failed:
            return "miss"
        return "pass" if all(run.good for run in self.runs) else "part"


def differences(run: Run, plain: Run) -> list[str]:
    """Options of a run that are not the defaults, as `numerics coupling = 'mics'`."""
    found = []
    for group in OPTIONS:
        own, usual = (r.parameters.get(group, [{}])[0] for r in (run, plain))
        found += [f"{group} {key} = {own[key]!r}" for key in own if own[key] != usual.get(key)]
    return found


def note_options(case: Case, plain: Run) -> None:
    """Find what the runs of a case change, and which of it the case is not about."""
    for run in case.runs:
        if run.good and (found := differences(Run(run.folder), plain)):
            case.options[run.name] = found
            case.strange += [f"{run.name}: {t}" for t in found if not t.startswith(case.varies)]


def write(cases: list[Case], folder: Path, plain: Run, level: str) -> None:
    """Write index.html and report.json."""
    folder.mkdir(parents=True, exist_ok=True)
    data = [_data(case) for case in cases]
    head = {
        "made": datetime.now().astimezone().isoformat(timespec="seconds"),
        "level": level,
        **{k: plain.provenance.get(k) for k in ("version", "git_revision", "compiler", "flags")},
    }
    text = json.dumps({**head, "cases": data}, indent=1, default=_plain)
    (folder / "report.json").write_text(text + "\n")
    (folder / "index.html").write_text(_page(head, cases, data))


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def _data(case: Case) -> dict[str, Any]:
    """A case as it stands in report.json."""
    checks = case.checks or Checks("")
    return {
        "name": case.name,
        "verdict": case.verdict,
        "results": [asdict(r) for r in checks.results],
        "routine": [asdict(r) for r in checks.routine],
        "studies": [
            {
                **asdict(s),
                "errors": s.errors,
                "orders": [_finite(p) for p in s.orders],
                "reference": _finite(s.reference),
            }
            for s in checks.studies
        ],
        "runs": [_cost(run) for run in case.runs],
        "options_that_differ": case.options,
        "undeclared": case.strange,
        "left_out": case.left_out,
        "problem": case.problem,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _cost(run: Finished) -> dict[str, Any]:
    found: dict[str, Any] = {"name": run.name, "seconds": round(run.seconds, 1), "ended": run.ended}
    if run.good:
        result = Run(run.folder)
        found["cells"] = [len(f) - 1 for f in result.grid.faces]
        found["steps"] = len(result.series.time) - 1
    return found


# --- figures


def _svg(figure: Any) -> str:
    text = io.BytesIO()
    figure.savefig(text, format="svg", bbox_inches="tight")
    plt.close(figure)
    code = base64.b64encode(text.getvalue()).decode()
    return f'<img alt="" src="data:image/svg+xml;base64,{code}">'


def _axes(x: str, y: str, title: str) -> tuple[Any, Axes]:
    figure, axes = plt.subplots(figsize=(5.2, 3.5))
    axes.set(xlabel=x, ylabel=y)
    axes.set_title(title, fontsize=10, loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e4e4e4", linewidth=0.6)
    return figure, axes


def draw(curves: Figure) -> str:
    """Ours as lines over the reference, as an image element."""
    figure, axes = _axes(curves.x, curves.y, curves.title)
    for k, (name, (x, y)) in enumerate(curves.reference.items()):
        style = "--" if curves.smooth else "o"
        axes.plot(x, y, style, color=THEIRS[k % len(THEIRS)], markersize=3.5, label=name)
    for k, (name, (x, y)) in enumerate(curves.ours.items()):
        mark = "." if len(x) < 12 else ""
        axes.plot(x, y, color=OURS[k % len(OURS)], linewidth=1.3, marker=mark, label=name)
    axes.legend(fontsize=8, frameon=False)
    return _svg(figure)


def draw_study(study: Study) -> str:
    """Error over resolution, both logarithmic, with the slopes of first and second order."""
    figure, axes = _axes(study.resolution, "|error|", study.quantity)
    cells, errors = np.array(study.cells), np.abs(study.errors)
    shown = errors > 0
    axes.loglog(cells[shown], errors[shown], "o-", color=OURS[0], linewidth=1.3)
    if shown.any():
        for order, style in ((1, ":"), (2, "--")):
            slope = errors[shown][0] * (cells[shown][0] / cells[shown]) ** order
            axes.loglog(cells[shown], slope, style, color="#999999", label=f"order {order}")
        axes.legend(fontsize=8, frameon=False)
    axes.set_xticks(cells, [f"{c:g}" for c in cells])
    low, high = axes.get_ylim()
    narrow = high < 10 * low  # perhaps without a power of ten to label
    axes.yaxis.set_major_locator(MaxNLocator(4) if narrow else LogLocator())
    axes.yaxis.set_major_formatter("{x:.2g}")
    axes.minorticks_off()
    return _svg(figure)


# --- page

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 68rem; margin: 2rem auto;
  padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 3rem; border-top: 1px solid #ccc;
  padding-top: 1rem; }
table { border-collapse: collapse; margin: .8rem 0; font-size: 14px; }
th { text-align: left; font-weight: 600; border-bottom: 1px solid #999; }
th, td { padding: .15rem .9rem .15rem 0; vertical-align: top; }
td.n { font-variant-numeric: tabular-nums; white-space: nowrap; }
.pass { color: #1a6b1a; } .miss { color: #b00020; font-weight: 600; }
.part, .info { color: #777; } img { max-width: 32rem; width: 49%; min-width: 20rem; }
code { font-size: 13px; } a { color: #0b5394; } summary { cursor: pointer; color: #555; }
"""


def _page(head: dict[str, Any], cases: list[Case], data: list[dict[str, Any]]) -> str:
    count = {word: sum(case.verdict == word for case in cases) for word in ("pass", "miss")}
    rest = len(cases) - sum(count.values())
    seconds = sum(run.seconds for case in cases for run in case.runs)
    lines = [
        "<!doctype html><html lang='en'><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width'><title>mics: verification</title>",
        f"<style>{STYLE}</style><h1>mics: verification</h1>",
        f"<p>{len(cases)} cases: <span class='pass'>{count['pass']} pass</span>, "
        f"<span class='{'miss' if count['miss'] else 'info'}'>{count['miss']} miss</span>"
        f"{f', {rest} in part or not run' if rest else ''}. "
        f"Level {_safe(head['level'])}, {seconds / 3600:.1f} core hours, made {head['made']} with "
        f"version {_safe(head['version'])}, revision {_safe(head['git_revision'])}, "
        f"<code>{_safe(head['compiler'])}</code>, <code>{_safe(head['flags'])}</code>.</p>",
        "<table><tr><th>case</th><th></th><th>results</th><th>core time</th></tr>",
    ]
    for case in cases:
        checks = case.checks or Checks("")
        counting = [r for r in checks.results + checks.routine if r.counts]
        held = sum(r.holds for r in counting)
        took = sum(run.seconds for run in case.runs)
        lines.append(
            f"<tr><td><a href='#{case.name}'>{_safe(_title(case))}</a></td>{_verdict(case)}"
            f"<td class='n'>{held} of {len(counting)}</td><td class='n'>{_time(took)}</td></tr>"
        )
    lines.append("</table>")
    for case, its in zip(cases, data, strict=True):
        lines += _section(case, its)
    return "\n".join([*lines, "</html>", ""])


def _section(case: Case, data: dict[str, Any]) -> list[str]:
    checks = case.checks or Checks("")
    lines = [f"<h2 id='{case.name}'>{_safe(_title(case))}</h2>", f"<p>{_about(case)}</p>"]
    for trouble in (case.problem, *(f"{r.name}: {r.ended}" for r in case.runs if not r.good)):
        lines += [f"<p class='miss'>{_safe(trouble)}</p>"] if trouble else []
    if checks.results:
        lines += _table(checks.results)
    lines += [draw(curves) for curves in checks.figures]
    lines += [draw_study(study) for study in checks.studies]
    for study in checks.studies:
        lines += _study(study)
    if checks.routine:
        held = sum(r.holds for r in checks.routine)
        inside = "<details><summary>" if held == len(checks.routine) else "<details open><summary>"
        lines += [
            f"{inside}divergence, liquid, end of the runs: {held} of {len(checks.routine)} "
            "hold</summary>",
            *_table(checks.routine),
            "</details>",
        ]
    lines.append(
        "<table><tr><th>run</th><th>cells</th><th>steps</th><th>core time</th>"
        "<th>options other than the defaults</th></tr>"
    )
    for run in data["runs"]:
        options = "<br>".join(map(_safe, data["options_that_differ"].get(run["name"], [])))
        cells = " × ".join(map(str, run.get("cells", [])))
        lines.append(
            f"<tr><td>{_safe(run['name'])}</td><td class='n'>{cells}</td>"
            f"<td class='n'>{run.get('steps', '')}</td><td class='n'>{_time(run['seconds'])}</td>"
            f"<td>{options or 'none'}</td></tr>"
        )
    lines.append("</table>")
    for text in case.strange:
        lines.append(f"<p class='miss'>not what the case is about: {_safe(text)}</p>")
    if case.left_out:
        lines.append(f"<p class='info'>left out here: {_safe(', '.join(case.left_out))}</p>")
    return lines


def _table(results: list[Result]) -> list[str]:
    lines = [
        "<table><tr><th>quantity</th><th>ours</th><th>reference</th><th>error</th>"
        "<th>band</th><th></th></tr>"
    ]
    for r in results:
        mark = ("pass" if r.holds else "miss") if r.counts else "info"
        word = ("pass" if r.holds else "miss") if r.counts else "for information"
        cells = "".join(
            f"<td class='n'>{_safe(t)}</td>" for t in (r.ours, r.reference, r.error, r.band)
        )
        lines.append(f"<tr><td>{_safe(r.quantity)}</td>{cells}<td class='{mark}'>{word}</td></tr>")
    return [*lines, "</table>"]


def _study(study: Study) -> list[str]:
    orders = ", ".join(f"{p:.2f}" for p in study.orders) or "-"
    lines = [
        f"<table><tr><th>{_safe(study.resolution)}</th><th>{_safe(study.quantity)}</th>"
        "<th>error</th></tr>"
    ]
    for cells, value, error in zip(study.cells, study.values, study.errors, strict=True):
        lines.append(
            f"<tr><td class='n'>{cells:g}</td><td class='n'>{value:.6g}</td>"
            f"<td class='n'>{100 * error:+.3g} %</td></tr>"
        )
    against = "" if math.isfinite(study.reference) else "; no reference: errors against the finest"
    return [*lines, "</table>", f"<p>observed order: {orders}{against}</p>"]


def _verdict(case: Case) -> str:
    return f"<td class='{case.verdict.replace(' ', '-')}'>{case.verdict}</td>"


def _time(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _readme(case: Case) -> str:
    path = CASES / case.name / "README.md"
    return path.read_text() if path.is_file() else f"# {case.name}\n"


def _title(case: Case) -> str:
    return _readme(case).splitlines()[0].lstrip("# ")


def _about(case: Case) -> str:
    """The first paragraph of the case's README."""
    parts = [
        part for part in _readme(case).split("\n\n") if not part.startswith(("#", "|", "    "))
    ]
    text = _safe(parts[0]) if parts else ""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", text)


def _safe(value: Any) -> str:
    return html.escape(str(value))
