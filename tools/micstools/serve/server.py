"""A server for the person at this machine: it listens on the loopback address, answers the browser
that opened it, and nobody whom another page sends.

A name in `Host` other than ours is refused. The key in the address lets one browser in, once and
soon; it stands in no command line, for the browser is sent to a private file. From then on it has a
cookie that other pages cannot send along. What changes something needs a token in a header, which a
foreign page can neither read nor set.
"""

import asyncio
import contextlib
import hmac
import json
import os
import secrets
import sys
import time
import traceback
import webbrowser
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from aiohttp import web

from micstools.pages.html import Markup, tag
from micstools.reading.reader import BadRun

T = TypeVar("T")
ADDRESS = "127.0.0.1"
NAMES = (ADDRESS, "localhost")
TOKEN = "X-Mics-Token"
_OURS = ("same-origin", "none")  # values of Sec-Fetch-Site
_SECURE = {
    "Content-Security-Policy": "default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_FOREIGN = {  # a page that somebody else may have written: its scripts run, and reach nothing
    "Cross-Origin-Opener-Policy": "unsafe-none",  # no other goes with a sandbox
    "Content-Security-Policy": "sandbox allow-scripts; default-src 'none'; img-src data:; "
    "style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'",
}
_LARGEST = 8_000_000  # bytes of a request
_SOON = 300.0  # that a key of the address lets somebody in [s]
_PATIENCE = 30.0  # with a request that does not come to its end [s]

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


@dataclass
class Site:
    """What is served: handlers by method and path, and the secrets of one server."""

    session: str = field(default_factory=lambda: secrets.token_urlsafe(24))  # of the cookie
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    keys: dict[str, float] = field(default_factory=dict)  # not used yet, and when they die [s]
    entered: asyncio.Event = field(default_factory=asyncio.Event)
    routes: list[tuple[str, str, Handler]] = field(default_factory=list)
    port: int = 0

    @property
    def cookie(self) -> str:
        """Its name; cookies do not know ports."""
        return f"mics-{self.port}"

    def address(self) -> str:
        """Where a browser begins; each has a key of its own."""
        key = secrets.token_urlsafe(24)
        self.keys[key] = time.monotonic() + _SOON
        return f"http://{ADDRESS}:{self.port}/?key={key}"

    def head(self) -> Markup:
        """What a page needs to be allowed to change something."""
        return tag("meta", name="mics-token", content=self.token)

    def get(self, path: str, handler: Handler) -> None:
        """Answer to what only looks."""
        self.routes.append(("GET", path, handler))

    def post(self, path: str, handler: Handler) -> None:
        """Answer to what changes something."""
        self.routes.append(("POST", path, handler))

    def runner(self) -> web.AppRunner:
        """What serves it; a connection without a whole request is closed after a while."""
        found = web.Application(middlewares=[self._guard], client_max_size=_LARGEST)
        found.add_routes([web.route(method, path, work) for method, path, work in self.routes])
        return web.AppRunner(found, access_log=None, keepalive_timeout=_PATIENCE)

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse what does not come from our own page; tell trouble in a line."""
        try:
            answer = self._refusal(request) or await handler(request)
        except web.HTTPException as problem:
            kept = {n: problem.headers[n] for n in ("Allow", "Location") if n in problem.headers}
            answer = web.Response(status=problem.status, text=problem.reason, headers=kept)
        except (BadRun, OSError) as problem:
            answer = json_answer({"error": str(problem)}, 422)
        except Exception as fault:  # of ours: told, and the page goes on
            traceback.print_exc()
            answer = json_answer({"error": f"a fault of mics-tools: {fault!r}"}, 500)
        for name, value in _SECURE.items():
            answer.headers.setdefault(name, value)
        return answer

    def _refusal(self, request: web.Request) -> web.Response | None:
        hosts = [f"{name}:{self.port}" for name in NAMES]
        origin = request.headers.get("Origin")
        if request.headers.getall("Host", []) not in [[host] for host in hosts]:
            return web.Response(status=421, text="no such host")
        if origin is not None and origin not in [f"http://{host}" for host in hosts]:
            return web.Response(status=403, text="another page asks")
        sent = request.headers.get("Sec-Fetch-Site", "none") not in _OURS
        entering = request.method == "GET" and request.path == "/" and "key" in request.query
        if entering and self._lets_in(request.query["key"]):
            # a browser that was `sent` by the private file would follow a redirect without the
            # cookie, as for any other page
            self.entered.set()
            if sent:
                answer = page_answer(_forward("/"))
            else:
                answer = web.Response(status=303, headers={"Location": "/"})
            answer.set_cookie(self.cookie, self.session, httponly=True, samesite="Strict", path="/")
            return answer
        if sent:
            return web.Response(status=403, text="another page asks")
        if not _same(request.cookies.get(self.cookie, ""), self.session):
            words = "open the address that mics-tools printed; Enter in its window prints another"
            return web.Response(status=403, text=words)
        if request.method != "GET" and not _same(request.headers.get(TOKEN, ""), self.token):
            return web.Response(status=403, text="this page is of an earlier call: load it anew")
        return None

    def _lets_in(self, given: str) -> bool:
        """Is it a key that nobody has used? It is used now."""
        now = time.monotonic()
        self.keys = {key: end for key, end in self.keys.items() if end > now}
        found = [key for key in self.keys if _same(given, key)]
        return bool(found and self.keys.pop(found[0]))


def _same(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode(errors="replace"), wanted.encode())


async def order_of(request: web.Request) -> dict[str, Any]:
    """What a request asks for: an object of JSON, with numbers and texts that can be written."""
    try:
        async with asyncio.timeout(_PATIENCE):
            body = await request.read()
    except TimeoutError:
        raise web.HTTPRequestTimeout(reason="the request does not come to its end") from None
    try:
        found = json.loads(body)
        json.dumps(found, ensure_ascii=False, allow_nan=False).encode()
    except (ValueError, RecursionError):
        raise web.HTTPBadRequest(reason="the request is no JSON") from None
    if not isinstance(found, dict):
        raise web.HTTPBadRequest(reason="the request is no object")
    return found


def json_answer(content: Any, status: int = 200) -> web.Response:
    """Finite numbers and texts for a script."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return web.Response(text=text, content_type="application/json", status=status)


def page_answer(text: str) -> web.Response:
    """A page."""
    return web.Response(text=text, content_type="text/html", charset="utf-8")


def foreign_answer(text: str) -> web.Response:
    """A page that somebody else may have written."""
    answer = page_answer(text)
    answer.headers.update(_FOREIGN)
    return answer


def _forward(address: str) -> str:
    return f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">\n'


async def apart(work: Callable[..., T], *given: Any) -> T:
    """The result of work that takes long, done beside the server."""
    return await asyncio.get_running_loop().run_in_executor(None, partial(work, *given))


def serve(site: Site, port: int | None, browser: bool) -> None:
    """Serve until Ctrl-C; print the address, and open it in the browser."""
    try:
        asyncio.run(_serve(site, port or 0, browser))
    except OSError as problem:
        raise BadRun(f"--port {port}: {problem.strerror or problem}") from problem


async def _serve(site: Site, port: int, browser: bool) -> None:
    runner = site.runner()
    await runner.setup()
    try:
        listener = web.TCPSite(runner, ADDRESS, port)
        await listener.start()
        site.port = runner.addresses[0][1]
        print(site.address())
        print("(this machine only, one browser; Ctrl-C ends the page, not a run)", flush=True)
        if sys.stdin and sys.stdin.isatty():
            asyncio.get_running_loop().add_reader(sys.stdin, _print_another, site)
        if browser:
            await _open(site)
        await asyncio.Event().wait()
    finally:
        await runner.cleanup()


def _print_another(site: Site) -> None:
    """After Enter, an address for another browser, or for one that has lost its cookie."""
    loop = asyncio.get_running_loop()
    loop.remove_reader(sys.stdin)
    with contextlib.suppress(OSError):  # the terminal has gone
        ours = os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()  # else it was typed for a shell
        if ours and not sys.stdin.readline():
            return
        if ours:
            print(site.address(), flush=True)
        loop.call_later(0 if ours else 1, loop.add_reader, sys.stdin, _print_another, site)


async def _open(site: Site) -> None:
    """Open the browser on a private file that sends it to us. The file lies in the home folder:
    browsers in a sandbox of their own see no folder of temporary files."""
    home = Path.home() if os.access(Path.home(), os.W_OK) else None
    with TemporaryDirectory(prefix="mics-page-", dir=home) as folder:
        page = Path(folder, "open.html")
        page.touch(mode=0o600)
        page.write_text(_forward(site.address()))
        if not await apart(webbrowser.open, page.as_uri()):
            print("no browser here: open the address yourself", file=sys.stderr, flush=True)
            return
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(site.entered.wait(), _SOON)
