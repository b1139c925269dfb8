"""Edits a case on a page of this machine, checks it as one types, runs it and watches the run."""

import os
import subprocess
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from aiohttp import web

from micstools.cases import program
from micstools.command import OUTPUT, folder_in
from micstools.pages.html import Markup, data, document, filled, markup, tag
from micstools.pages.parts import player
from micstools.reading.reader import BadRun
from micstools.serve import watch_page
from micstools.serve.draft import Draft, Stale
from micstools.serve.server import Site, apart, json_answer, order_of, page_answer
from micstools.serve.watch import MICS_TOOLS, Ensemble, Watch, Watched

SCRIPTS = ("plan", "live", "form", "studio")
_CORES = os.cpu_count() or 1
_RESULTS = ("run.h5", "ensemble.json")
_START = "const studio = startStudio();\n"


class Begun(Watch):
    """Watches what was begun here; what the program says goes to `log`."""

    process: subprocess.Popen[bytes] | None = None
    older: object = None  # when the results began that lay there before

    @property
    def goes_on(self) -> bool:
        """Does the program live, or another one that writes to the folder?"""
        alive = self.process is not None and self.process.poll() is None
        return alive or self.watched.goes_on

    def begin(self, watched: Watched | Ensemble, words: list[str], older: object = None) -> None:
        """Start a program that writes to what is watched from now on. Its session is its own:
        Ctrl-C ends the page, not the run."""
        self.watched, self.older = watched, older
        self.log = tempfile.TemporaryFile()  # noqa: SIM115
        self.process = subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self.log,
            env={**program.ENVIRONMENT, **os.environ}, start_new_session=True)  # fmt: skip

    def look(self) -> dict[str, Any]:
        """As of any run; what the program said besides."""
        goes_on, found = self.goes_on, super().look()
        if self.process is None:
            return found
        watched = self.watched
        if isinstance(watched, Watched) and self.older and watched.began == self.older:
            waits = watch_page.waiting(watched.folder, "Waiting for the run to begin.")
            found |= {"parts": waits, "key": "", "running": False}
        size = os.fstat(self.log.fileno()).st_size  # its place is that of the program, too
        said = os.pread(self.log.fileno(), 4000, max(0, size - 4000)).decode(errors="replace")
        said = said.strip()
        found["parts"]["log"] = tag("pre", said) if said else markup()
        if not found["key"] and not goes_on:
            code = self.process.returncode
            found["parts"]["state"] = markup(f"The program ended with code {code}.")
        return found | {"running": found["running"] or goes_on}

    async def _stop(self, request: web.Request) -> web.Response:
        if self.process and self.process.poll() is None and not self.watched.goes_on:
            self.process.terminate()
            return json_answer({"told": "asked to stop before it begins"})
        return await super()._stop(request)


class Studio:
    """The answers of the page of a case."""

    def __init__(self, draft: Draft) -> None:
        """Of a case that is being edited."""
        self.draft, self.site, self.threads = draft, Site(), _CORES
        # They may go on since another studio was here
        repeats, run = Ensemble(self._repeats()), Watched(self._folder())
        self.watch = Begun(repeats if repeats.goes_on else run)
        self.watch.add_to(self.site)
        self.site.get("/", self._page)
        self.site.get("/watch", self._watch)
        self.site.get("/draft", partial(self._tell, draft.state))
        self.site.get("/check", partial(self._tell, draft.look))
        changes = {"/edit": draft.edit, "/save": lambda _: draft.save(), "/run": self._begin,
                   "/repeat": self._begin_repeats}  # fmt: skip
        for path, work in changes.items():
            self.site.post(path, partial(self._changed, work))
        self.site.post("/go-on", partial(self._tell, self._continue))

    async def _page(self, _: web.Request) -> web.Response:
        return page_answer(frame(self.draft, self.site.head(), await apart(self._known)))

    def _known(self) -> bool:
        """Is there a run to watch?"""
        folder = self.watch.watched.folder
        return self.watch.goes_on or any((folder / name).is_file() for name in _RESULTS)

    async def _tell(self, work: Callable[[], dict[str, Any]], _: web.Request) -> web.Response:
        return json_answer(await apart(work))

    async def _changed(
        self, work: Callable[[dict[str, Any]], dict[str, Any] | None], request: web.Request
    ) -> web.Response:
        """Work on the text that the page shows; where it is no longer that, the newest one."""
        order = await order_of(request)

        def based() -> dict[str, Any]:
            with self.draft.lock:
                self.draft.require(order.get("number"))
                return work(order) or self.draft.state()

        try:
            return json_answer(await apart(based))
        except Stale as problem:
            state = await apart(self.draft.state)
            return json_answer({"error": str(problem), "state": state}, 409)
        except (KeyError, TypeError, ValueError, OverflowError) as problem:
            raise web.HTTPBadRequest(reason="this change cannot be made") from problem

    def _begin(self, order: dict[str, Any]) -> dict[str, Any]:
        """Run the case, while the draft is locked: one at a time."""
        self.threads = int(order.get("threads") or _CORES)
        self._keep()
        self._start(Watched(self._folder()))
        return {"told": "the run begins", "open": "/watch"}

    def _begin_repeats(self, order: dict[str, Any]) -> dict[str, Any]:
        """Run it many times, as `mics-tools ensemble` does."""
        self._keep()
        words = ["ensemble", self.draft.case, "--program", self.draft.program,
                 "--out", self._repeats(), "--runs", int(order["runs"]),
                 "--jobs", int(order.get("threads") or _CORES)]  # fmt: skip
        words += ["--spread", float(order["spread"])] if order.get("spread") else []
        self.watch.begin(Ensemble(self._repeats()), [*MICS_TOOLS, *map(str, words)])
        return {"told": "the runs begin", "open": "/watch"}

    def _keep(self) -> None:
        self._require_rest()
        if self.draft.look()["problems"]:
            raise BadRun("the program refuses this case: mend what is marked first")
        self.draft.save()

    def _continue(self) -> dict[str, Any]:
        """The run that was stopped, from its newest restart file."""
        with self.draft.lock:
            self._require_rest()
            watched = self.watch.watched
            with watched.lock:
                run = watched.look() if isinstance(watched, Watched) else None
            if run is None or not run.restart_files:
                raise BadRun("there is no restart file to go on from")
            self._start(Watched(run.folder), "--restart", str(run.folder / run.restart_files[-1]))
        return {"told": "the run goes on"}

    def _repeats(self) -> Path:
        """The folder of many runs."""
        return Path(f"mics-ensemble-{self.draft.case.stem}")

    def _folder(self) -> Path:
        """The results of the case as it is saved."""
        with suppress(BadRun):  # it cannot be read
            return folder_in(self.draft.saved)
        return Path(OUTPUT)

    def _require_rest(self) -> None:
        others = (Watched(self._folder()), Ensemble(self._repeats()))
        for one in [self.watch.watched] if self.watch.goes_on else others:
            if self.watch.goes_on or one.goes_on:
                raise BadRun(f"a run goes on in {one.folder}: stop it first, or wait")

    def _start(self, watched: Watched, *more: str) -> None:
        """The program on the case as it is saved."""
        words = [str(self.draft.program), "--quiet", "--threads", str(self.threads), *more]
        older = watched.began if not more and watched.look() else None
        self.watch.begin(watched, [*words, str(self.draft.case)], older)

    async def _watch(self, _: web.Request) -> web.Response:
        if not await apart(self._known):
            raise web.HTTPSeeOther("/")
        back = tag("p", tag("a", "← back to the case", href="/"), class_="note")
        watched = self.watch.watched
        go_on = tag("button", "Go on", type="button", id="go-on")
        title = await apart(watched.title)
        return page_answer(watch_page.frame(watched.page, title, self.site.head(), back, go_on))


def frame(draft: Draft, head: Markup, known: bool) -> str:
    """The page of a case; form and check come later. `known`: there is a run to watch."""
    label = "the set-up; arrow keys turn it, + and - zoom; in a flat view drag a block to move it"
    content = filled(
        "studio",
        schema=data("schema", draft.schema),
        physics=filled("physics"),
        name=draft.case.name,
        watch=tag("a", "the run", href="/watch") if known else None,
        cores=_CORES,
        none=Markup("" if draft.ours.is_dir() else "hidden"),
        player=player("player", label, plan=True, hint=_HINT),
    )
    return document(f"{draft.case.name} – mics studio", content, script=_START, more=SCRIPTS,
                    head=head, wide=True)  # fmt: skip


_HINT = (
    "Front, side and top are to scale: drag a block to move it, drag elsewhere to measure, with "
    "Shift to shift the view. In the corner view drag to turn."
)


def site_of(case: Path, path: Path) -> Site:
    """The site of a case; `path` is that of the program."""
    return Studio(Draft(case, path)).site
