"""A server for the person at this machine: it listens on the loopback address, answers whoever has
the key of its first address, and nobody whom another page sends.

A name in `Host` other than ours is refused, so no name of a foreign page can be bent to us; the
key comes once in the address, then in a cookie that other pages cannot send along; what changes
something needs a token in a header, which a foreign page can neither read nor set.
"""

import asyncio
import hmac
import json
import secrets
import sys
import traceback
import webbrowser
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import partial
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
_LARGEST = 8_000_000  # bytes of a request

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


@dataclass
class Site:
    """What is served: handlers by method and path, and the secrets of one server."""

    key: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    routes: list[tuple[str, str, Handler]] = field(default_factory=list)
    port: int = 0

    @property
    def cookie(self) -> str:
        """Its name; cookies do not know ports."""
        return f"mics-{self.port}"

    @property
    def address(self) -> str:
        """Where the browser begins."""
        return f"http://{ADDRESS}:{self.port}/?key={self.key}"

    def head(self) -> Markup:
        """What a page needs to be allowed to change something."""
        return tag("meta", name="mics-token", content=self.token)

    def get(self, path: str, handler: Handler) -> None:
        """Answer to what only looks."""
        self.routes.append(("GET", path, handler))

    def post(self, path: str, handler: Handler) -> None:
        """Answer to what changes something."""
        self.routes.append(("POST", path, handler))

    def app(self) -> web.Application:
        """The application, with its guard."""
        found = web.Application(middlewares=[self._guard], client_max_size=_LARGEST)
        found.add_routes([web.route(method, path, work) for method, path, work in self.routes])
        return found

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse what does not come from our own page; tell trouble in a line."""
        try:
            answer = self._refusal(request) or await handler(request)
        except web.HTTPException as problem:
            answer = web.Response(status=problem.status, text=problem.reason)
        except (BadRun, OSError) as problem:
            answer = json_answer({"error": str(problem)}, 422)
        except Exception as fault:  # of ours: told, and the page goes on
            traceback.print_exc()
            answer = json_answer({"error": f"a fault of mics-tools: {fault!r}"}, 500)
        answer.headers.update(_SECURE)
        return answer

    def _refusal(self, request: web.Request) -> web.Response | None:
        hosts = [f"{name}:{self.port}" for name in NAMES]
        origin = request.headers.get("Origin")
        if request.headers.getall("Host", []) not in [[host] for host in hosts]:
            return web.Response(status=421, text="no such host")
        if origin is not None and origin not in [f"http://{host}" for host in hosts]:
            return web.Response(status=403, text="another page asks")
        entering = request.method == "GET" and request.path == "/" and "key" in request.query
        if entering and _same(request.query["key"], self.key):
            answer = web.Response(status=303, headers={"Location": "/"})
            answer.set_cookie(self.cookie, self.key, httponly=True, samesite="Strict", path="/")
            return answer
        if request.headers.get("Sec-Fetch-Site", "none") not in _OURS:
            return web.Response(status=403, text="another page asks")
        if not _same(request.cookies.get(self.cookie, ""), self.key):
            return web.Response(status=403, text="open the address that mics-tools printed")
        if request.method != "GET" and not _same(request.headers.get(TOKEN, ""), self.token):
            return web.Response(status=403, text="no token")
        return None


def _same(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode(), wanted.encode())


def json_answer(content: Any, status: int = 200) -> web.Response:
    """Numbers and texts for a script; what is not finite is none."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return web.Response(text=text, content_type="application/json", status=status)


def page_answer(text: str) -> web.Response:
    """A page."""
    return web.Response(text=text, content_type="text/html", charset="utf-8")


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
    runner = web.AppRunner(site.app(), access_log=None)
    await runner.setup()
    try:
        listener = web.TCPSite(runner, ADDRESS, port)
        await listener.start()
        site.port = runner.addresses[0][1]
        print(f"{site.address}\n(this machine only; Ctrl-C ends the page, not a run)", flush=True)
        if browser and not webbrowser.open(site.address):
            print("no browser here: open the address yourself", file=sys.stderr, flush=True)
        await asyncio.Event().wait()
    finally:
        await runner.cleanup()
