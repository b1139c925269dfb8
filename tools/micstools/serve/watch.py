"""Watches a run or an ensemble: reads its files at each look, changes nothing but by a button."""

import asyncio
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from aiohttp import web

from micstools.cases import settings
from micstools.ensembles import ensemble
from micstools.ensembles.ensemble import Member
from micstools.pages import motion, run_words
from micstools.piles import options, pile_ensemble
from micstools.reading.reader import BadRun, Run
from micstools.serve import living, watch_page
from micstools.serve.server import Site, apart, foreign_answer, json_answer, order_of, page_answer

MOST = 600  # rows of blocks that are read of a run
_START = "import sys; sys.path[:] = filter(None, sys.path)\nfrom micstools import cli; cli.main()"
MICS_TOOLS = (sys.executable, "-c", _START)  # no module of the working folder is taken
TOOLS = {
    "/report": ("report",),
    "/pdf": ("report", "--pdf"),
    "/places": ("places", "--to", "csv,geojson,dxf"),
}
"""What a button asks for: a command, to which the folder is added."""


class Watched:
    """A run that may still grow. Looks are one at a time: they share what was read."""

    page = "watch_run"

    def __init__(self, folder: Path) -> None:
        """Of a folder that may not be there yet."""
        self.folder = folder
        self.lock = threading.Lock()
        self.run: Run | None = None
        self.trouble = ""  # with its file
        self.who: living.Holder | None = None  # wrote to it before the last look
        self.began: object = None
        self.still: dict[str, Any] = {}  # of the scene
        self.columns: motion.Columns = {}

    @property
    def goes_on(self) -> bool:
        """Does a program write to the folder?"""
        return living.holder(self.folder / "run.lock") is not None

    def look(self) -> Run | None:
        """The run as it is now; none before it has a row. A run that began anew is another one."""
        self.who = living.holder(self.folder / "run.lock")
        try:
            self.run = self.run or Run(self.folder, most=MOST)
            self.run.refresh()
            started = self.run.provenance.get("started")
            if started != self.began:
                self.began, self.still, self.columns = started, {}, {}
            return self.run if self.run.series.time.size and self.run.bodies.time.size else None
        except (FileNotFoundError, BadRun) as problem:
            self.run, self.trouble = None, str(problem) if isinstance(problem, BadRun) else ""
            return None

    def parts(self) -> dict[str, Any]:
        """What the page shows now, and whether that may change."""
        with self.lock:
            run = self.look()
            if run is None:
                parts = watch_page.waiting(self.folder, self.trouble)
                return {"parts": parts, "running": False, "key": ""}
            found = living.state(run, self.who)
            key = f"{self.began} {run.series.time[-1]}"
            return {"parts": watch_page.run_parts(run, found), "running": found.running, "key": key}

    def state(self) -> living.State | None:
        """How far it is; none before it has a row."""
        with self.lock:
            run = self.look()
            return living.state(run, self.who) if run else None

    def scene(self) -> dict[str, Any]:
        """The motion so far."""
        with self.lock:
            run = self.look()
            if run is None or not run.bodies.n:
                return {}
            self.still = self.still or motion.tank(run, options.told(run.folder).north)
            return self.still | motion.moving(run, self.columns)

    def title(self) -> str:
        """Of the case, else the folder."""
        with self.lock:
            run = self.look()
            return run_words.title(run) if run else self.folder.name


class Ensemble:
    """The runs of an ensemble; what is done is read once."""

    page = "watch_ensemble"

    def __init__(self, folder: Path) -> None:
        """Of its folder."""
        self.folder = folder
        self.lock = threading.Lock()
        self.done: dict[int, ensemble.State] = {}
        self.watched: dict[int, Watched] = {}

    @property
    def goes_on(self) -> bool:
        """Does a command compute its runs?"""
        return living.holder(self.folder / "ensemble.lock") is not None

    def members(self) -> list[Member]:
        """As the table of the ensemble has them."""
        about = pile_ensemble.about(self.folder / "ensemble.json")
        found = []
        for row in about["table"]:
            folder = self.folder / str(row["folder"])
            case = folder / "case.nml"
            text = case.read_text() if case.is_file() else str(about["case"])
            found.append(Member(int(row["run"]), int(row["seed"]), (), text, folder))
        return found

    def choices(self) -> dict[int, str]:
        """What is varied in each run, in words."""
        about = pile_ensemble.about(self.folder / "ensemble.json")
        names = [name for choice in about["choices"] for name in choice]
        said = ((int(row["run"]), [f"{k} = {row[k]}" for k in dict.fromkeys(names) if k in row])
                for row in about["table"])  # fmt: skip
        return {number: ", ".join(words) for number, words in said}

    def states(self) -> tuple[dict[Member, ensemble.State], dict[int, living.State]]:
        """How each run ended; of those that go on how far they are."""
        found: dict[Member, ensemble.State] = {}
        running: dict[int, living.State] = {}
        for member in self.members():
            one = self.of(member)
            far = one.state() if member.number not in self.done and one.goes_on else None
            end = self.done.get(member.number) or ensemble.state(member)
            if end.counts:
                self.done[member.number] = end
            elif far and far.running:
                running[member.number] = far
                end = ensemble.State("running")
            found[member] = end
        return found, running

    def title(self) -> str:
        """Of the case, else the folder."""
        if not pile_ensemble.is_ensemble(self.folder):
            return self.folder.resolve().name
        case = str(pile_ensemble.about(self.folder / "ensemble.json")["case"])
        said = str(settings.value(case, "run", "title") or "").strip()
        return said or self.folder.resolve().name

    def of(self, member: Member) -> Watched:
        """The run of a member."""
        return self.watched.setdefault(member.number, Watched(member.result))

    def parts(self) -> dict[str, Any]:
        """What the page shows now, and whether that may change."""
        if not pile_ensemble.is_ensemble(self.folder):
            return {"parts": watch_page.waiting(self.folder, ""), "running": False, "key": ""}
        with self.lock:
            states, running = self.states()
            choices = self.choices()
            parts = watch_page.ensemble_parts(states, running, lambda m: choices[m.number])
            alive = bool(running) or self.goes_on
            key = " ".join(f"{n}:{s.time}" for n, s in running.items()) + f" {len(self.done)}"
            return {"parts": parts, "running": alive, "key": key}

    def scene(self, number: int) -> dict[str, Any]:
        """The motion of a run so far."""
        with self.lock:
            chosen = [m for m in self.members() if m.number == number]
        return self.of(chosen[0]).scene() if chosen else {}

    def stop(self) -> str:
        """Let all runs end."""
        with self.lock:
            _, running = self.states()
            results = [m.result for m in self.members() if m.number in running]
        return living.stop_ensemble(self.folder, results)


def tool(*words: str) -> str:
    """What a command of mics-tools tells. Raises BadRun with what it says where it refuses."""
    done = subprocess.run([*MICS_TOOLS, *words], capture_output=True, text=True)
    if done.returncode:
        raise BadRun(done.stderr.strip() or f"{words[0]} ended with {done.returncode}")
    return (done.stdout + done.stderr).strip()


class Watch:
    """The answers of a page of a run or an ensemble."""

    def __init__(self, watched: Watched | Ensemble) -> None:
        """Of what is watched."""
        self.watched, self.using = watched, asyncio.Lock()

    @property
    def report(self) -> Path:
        """The file of the report."""
        return self.watched.folder / "report.html"

    def add_to(self, site: Site) -> None:
        """Answer for it on a site, below `/live`."""
        site.get("/live", self._parts)
        site.get("/scene", self._scene)
        site.post("/stop", self._stop)
        for path in TOOLS:
            site.post(path, self._use)
        site.get("/report", self._report)

    def look(self) -> dict[str, Any]:
        """What the page shows now, and of which folder."""
        return self.watched.parts() | {"of": str(self.watched.folder)}

    async def _parts(self, _: web.Request) -> web.Response:
        return json_answer(await apart(self.look))

    async def _scene(self, request: web.Request) -> web.Response:
        if isinstance(self.watched, Ensemble):
            number = request.query.get("run", "0")  # none is chosen
            if not re.fullmatch("[0-9]{1,9}", number):
                raise web.HTTPBadRequest(reason=f"there is no run '{number[:20]}'")
            return json_answer(await apart(self.watched.scene, int(number)))
        return json_answer(await apart(self.watched.scene))

    async def _stop(self, request: web.Request) -> web.Response:
        how = (await order_of(request)).get("how")
        if how not in ("restart", "now"):
            raise BadRun("a run is stopped 'restart' or 'now'")
        if isinstance(self.watched, Ensemble):
            return json_answer({"told": await apart(self.watched.stop)})
        work = living.ask_to_stop if how == "restart" else living.stop_at_once
        return json_answer({"told": work(self.watched.folder)})

    async def _use(self, request: web.Request) -> web.Response:
        name, *more = TOOLS[request.path]
        if self.using.locked():
            raise BadRun("one file is being made: wait for it")
        async with self.using:
            told = await apart(tool, name, str(self.watched.folder), *more)
        opened = {"open": "/report"} if request.path == "/report" else {}
        return json_answer({"told": told, **opened})

    async def _report(self, _: web.Request) -> web.Response:
        if not self.report.is_file():
            raise web.HTTPNotFound(reason="no report yet")
        return foreign_answer(self.report.read_text(encoding="utf-8"))


def site_of(folder: Path) -> Site:
    """The site of a run or an ensemble."""
    site = Site()
    many = (folder / "ensemble.lock").exists() or pile_ensemble.is_ensemble(folder)
    watched = Ensemble(folder) if many else Watched(folder)
    Watch(watched).add_to(site)

    async def first(_: web.Request) -> web.Response:
        title = await apart(watched.title)
        return page_answer(watch_page.frame(watched.page, title, site.head()))

    site.get("/", first)
    return site
