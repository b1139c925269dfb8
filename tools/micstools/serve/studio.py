"""Edits a case on a page of this machine, checks it as one types, runs it and watches the run."""

import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from aiohttp import web

from micstools.cases import program, settings
from micstools.command import OUTPUT
from micstools.pages.html import Markup, document, markup, tag
from micstools.pages.parts import player
from micstools.reading.reader import BadRun
from micstools.serve import form, watch_page
from micstools.serve.draft import Draft
from micstools.serve.server import Site, apart, json_answer, page_answer
from micstools.serve.watch import Watch, Watched

SCRIPTS = ("plan", "live", "studio")
_PARTS = ("warnings", "facts", "blocks", "plan")
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
        self.draft, self.site, self.started = draft, Site(), None
        self.watch = Watch(Watched(Path(OUTPUT)))
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

    started: Started | None

    async def _page(self, _: web.Request) -> web.Response:
        return page_answer(frame(self.draft, self.site.head()))

    async def _state(self, _: web.Request) -> web.Response:
        return json_answer(await apart(self.draft.state))

    async def _form(self, _: web.Request) -> web.Response:
        return json_answer({"form": await apart(form.form, self.draft)})

    async def _check(self, _: web.Request) -> web.Response:
        return json_answer(await apart(self.draft.look))

    async def _edit(self, request: web.Request) -> web.Response:
        order = await request.json()
        try:
            await apart(self.draft.edit, order)
        except (KeyError, TypeError, ValueError) as problem:
            raise BadRun(f"this change cannot be made ({problem})") from problem
        return json_answer(await apart(self.draft.state))

    async def _save(self, _: web.Request) -> web.Response:
        await apart(self.draft.save)
        return json_answer({"told": f"{self.draft.case} is written"})

    async def _run(self, _: web.Request) -> web.Response:
        await apart(self._begin)
        return json_answer({"told": "the run begins", "open": "/watch"})

    async def _go_on(self, _: web.Request) -> web.Response:
        await apart(self._continue)
        return json_answer({"told": "the run goes on"})

    def _begin(self) -> None:
        self._require_rest()
        self.draft.look()
        if not self.draft.accepted:
            raise BadRun("the program refuses this case: mend what is marked first")
        self.draft.save()
        folder = settings.value(self.draft.text, "run", "output") or OUTPUT
        self._start(Started(self.draft, Path(str(folder).strip())))

    def _continue(self) -> None:
        """The run that was stopped, from its newest restart file."""
        self._require_rest()
        run = self.started.look() if self.started else None
        if run is None or not run.restart_files:
            raise BadRun("there is no restart file to go on from")
        self._start(Started(self.draft, run.folder, run.folder / run.restart_files[-1]))

    def _require_rest(self) -> None:
        if self.started and self.started.goes_on:
            raise BadRun(f"a run goes on in {self.started.folder}: stop it first, or wait")

    def _start(self, started: Started) -> None:
        self.started = self.watch.watched = started

    async def _watch(self, _: web.Request) -> web.Response:
        if not self.started:
            raise web.HTTPSeeOther("/")
        back = tag("p", tag("a", "← back to the case", href="/"), class_="note")
        title = await apart(self.started.title)
        go_on = tag("button", "Go on", type="button", id="go-on")
        return page_answer(watch_page.run_frame(title, self.site.head(), back, go_on))


def frame(draft: Draft, head: Markup) -> str:
    """The page of a case; form and check come later."""
    label = "the set-up; arrow keys turn it, + and - zoom; in a flat view drag a block to move it"
    bar = tag(
        "div",
        tag("button", "Run", type="button", id="run", class_="play"),
        tag("button", "Save", type="button", id="save"),
        tag("button", "Undo", type="button", id="undo", disabled=True),
        tag("output", id="told", role="status"),
        class_="row bare",
    )
    ways = tag(
        "div",
        tag("button", "Form", type="button", data_show="form", aria_pressed="true"),
        tag("button", "Text", type="button", data_show="text", aria_pressed="false"),
        class_="group",
        role="group",
        aria_label="how to edit",
    )
    text = tag("textarea", id="text", spellcheck="false", aria_label="the case file", hidden=True)
    left = tag("div", ways, tag("div", id="form"), text, class_="edit")
    verdict = tag("p", "Checking …", id="verdict", role="status")
    wrong = tag("ol", id="problems", class_="remarks")
    view = player("player", label, plan=True, hint=_HINT)
    parts = [watch_page.place(name) for name in _PARTS]
    right = tag("div", verdict, wrong, view, *parts, class_="seen")
    return document(
        f"{draft.case.name} – mics studio",
        tag("h1", draft.case.name),
        bar,
        tag("div", left, right, class_="studio"),
        script=_START,
        more=SCRIPTS,
        head=head,
        wide=True,
    )


_HINT = (
    "Front, side and top are to scale: drag a block to move it, drag elsewhere to measure, with "
    "Shift to shift the view. In the corner view drag to turn."
)


def site_of(case: Path, path: Path) -> Site:
    """The site of a case; `path` is that of the program."""
    return Studio(Draft(case, path)).site
