"""Edits a case on a page of this machine, checks it as one types, runs it and watches the run."""

import os
import subprocess
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from aiohttp import web

from micstools.cases import program, settings
from micstools.command import OUTPUT
from micstools.pages.html import Markup, document, filled, markup, tag
from micstools.pages.parts import player
from micstools.reading.reader import BadRun
from micstools.serve import form, watch_page
from micstools.serve.draft import Draft, Stale
from micstools.serve.server import Site, apart, json_answer, order_of, page_answer
from micstools.serve.watch import Watch, Watched

SCRIPTS = ("plan", "live", "studio")
_START = "const studio = startStudio();\n"


class Started(Watched):
    """A run that was started here; what the program says goes to `log`."""

    def __init__(self, draft: Draft, folder: Path, restart: Path | None = None) -> None:
        """Start the program on the case as it is saved; `restart`: the file from which it goes
        on."""
        super().__init__(folder)
        self.log = tempfile.TemporaryFile("w+")  # noqa: SIM115 - as long as the run
        more = ["--restart", str(restart)] if restart else []
        words = [str(draft.program), "--quiet", *more, str(draft.case)]
        # In a session of its own: Ctrl-C ends the page, not the run.
        self.process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self.log,
            env={**program.ENVIRONMENT, **os.environ},
            start_new_session=True,
        )

    @property
    def goes_on(self) -> bool:
        """Does the program live?"""
        return self.process.poll() is None

    def parts(self) -> dict[str, Any]:
        """As of any run; what the program said besides."""
        goes_on, found = self.goes_on, super().parts()
        self.log.seek(0)
        said = self.log.read()[-4000:].strip()
        found["parts"]["log"] = tag("pre", said) if said else markup()
        if not found["key"] and not goes_on:
            code = self.process.returncode
            found["parts"]["state"] = markup(f"The program ended with code {code}.")
        return found | {"running": found["running"] or goes_on}


class Studio:
    """The answers of the page of a case."""

    def __init__(self, draft: Draft) -> None:
        """Of a case that is being edited."""
        self.draft, self.site = draft, Site()
        self.watched = Watched(self._folder())  # may go on since another studio was here
        self.watch = Watch(self.watched)
        self.watch.add_to(self.site)
        self.site.get("/", self._page)
        self.site.get("/draft", self._state)
        self.site.get("/form", self._form)
        self.site.get("/check", self._check)
        self.site.get("/watch", self._watch)
        self.site.post("/edit", self._edit)
        self.site.post("/save", self._save)
        self.site.post("/run", self._run)
        self.site.post("/go-on", self._go_on)

    async def _page(self, _: web.Request) -> web.Response:
        return page_answer(frame(self.draft, self.site.head(), await apart(self._known)))

    def _known(self) -> bool:
        """Is there a run to watch?"""
        return self.watched.goes_on or (self.watched.folder / "run.h5").is_file()

    async def _state(self, _: web.Request) -> web.Response:
        return json_answer(await apart(self.draft.state))

    async def _form(self, _: web.Request) -> web.Response:
        return json_answer({"form": await apart(form.form, self.draft)})

    async def _check(self, _: web.Request) -> web.Response:
        return json_answer(await apart(self.draft.look))

    async def _edit(self, request: web.Request) -> web.Response:
        return await self._changed(request, self.draft.edit)

    async def _save(self, request: web.Request) -> web.Response:
        return await self._changed(request, lambda _: self.draft.save())

    async def _run(self, request: web.Request) -> web.Response:
        return await self._changed(request, lambda _: self._begin())

    async def _changed(
        self, request: web.Request, work: Callable[[dict[str, Any]], dict[str, Any] | None]
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

    async def _go_on(self, _: web.Request) -> web.Response:
        await apart(self._continue)
        return json_answer({"told": "the run goes on"})

    def _begin(self) -> dict[str, Any]:
        """Run the case, while the draft is locked: one at a time."""
        self._require_rest()
        if self.draft.look()["problems"]:
            raise BadRun("the program refuses this case: mend what is marked first")
        self.draft.save()
        self._start(Started(self.draft, self._folder()))
        return {"told": "the run begins", "open": "/watch"}

    def _continue(self) -> None:
        """The run that was stopped, from its newest restart file."""
        with self.draft.lock:
            self._require_rest()
            run = self.watched.look()
            if run is None or not run.restart_files:
                raise BadRun("there is no restart file to go on from")
            self._start(Started(self.draft, run.folder, run.folder / run.restart_files[-1]))

    def _folder(self) -> Path:
        """The results of the case as it is saved."""
        with suppress(BadRun):  # it cannot be read
            return Path(str(settings.value(self.draft.saved, "run", "output") or OUTPUT).strip())
        return Path(OUTPUT)

    def _require_rest(self) -> None:
        for watched in (self.watched, Watched(self._folder())):
            if watched.goes_on:
                raise BadRun(f"a run goes on in {watched.folder}: stop it first, or wait")

    def _start(self, started: Started) -> None:
        self.watched = self.watch.watched = started

    async def _watch(self, _: web.Request) -> web.Response:
        if not await apart(self._known):
            raise web.HTTPSeeOther("/")
        back = tag("p", tag("a", "← back to the case", href="/"), class_="note")
        title = await apart(self.watched.title)
        go_on = tag("button", "Go on", type="button", id="go-on")
        return page_answer(watch_page.run_frame(title, self.site.head(), back, go_on))


def frame(draft: Draft, head: Markup, known: bool) -> str:
    """The page of a case; form and check come later. `known`: there is a run to watch."""
    label = "the set-up; arrow keys turn it, + and - zoom; in a flat view drag a block to move it"
    content = filled(
        "studio",
        name=draft.case.name,
        watch=tag("a", "the run", href="/watch") if known else None,
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
