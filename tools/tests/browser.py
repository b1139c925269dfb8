"""A headless Chromium that opens pages of ours; the devtools protocol over a pipe leads it."""

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from calls import NotYet

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
PROGRAM = next((path for name in PROGRAMS if (path := shutil.which(name))), None)
PATIENCE = 60  # [s]
MISSING = "" if PROGRAM else "no Chromium here: apt-get install chromium"
_OPTIONS = (  # no sandbox, for a test may run as root
    "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--hide-scrollbars", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--remote-debugging-pipe",
)  # fmt: skip


class Browser:
    """One window; keeps every error and every request of its page."""

    def __init__(self, profile: Path) -> None:
        """Start it with an empty `profile`."""
        to_it, from_us = os.pipe()
        from_it, to_us = os.pipe()
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (to_it, to_us)]

        def place_ends() -> None:
            os.dup2(ends[0], 3)  # it reads from 3 and writes to 4
            os.dup2(ends[1], 4)

        self.process = subprocess.Popen(
            [str(PROGRAM), *_OPTIONS, f"--user-data-dir={profile}", "about:blank"],
            close_fds=False,
            preexec_fn=place_ends,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for end in (to_it, to_us, *ends):
            os.close(end)
        self.out, self.into = os.fdopen(from_us, "wb", 0), os.fdopen(from_it, "rb", 0)
        self.rest, self.number, self.session = b"", 0, ""
        self.errors: list[str] = []
        self.requests: list[str] = []

    def __enter__(self) -> "Browser":
        (page,) = (
            target
            for target in self.call("Target.getTargets")["targetInfos"]
            if target["type"] == "page"
        )
        found = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self.session = found["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.session = ""
        self.call("Browser.close")
        self.process.wait(20)
        self.out.close()
        self.into.close()

    def call(self, method: str, **parameters: Any) -> Any:
        """Ask for something and wait for the answer."""
        self.number += 1
        message: dict[str, Any] = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.out.write(json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self.number:
                if "error" in answer:
                    error = NotYet if "navigated" in str(answer["error"]) else RuntimeError
                    raise error(f"{method}: {answer['error']}")
                return answer.get("result", {})
            kind, said = answer.get("method", ""), answer.get("params", {})
            if kind == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(said["exceptionDetails"])[:2000])
            elif kind == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning"):
                self.errors.append(json.dumps(said["args"])[:2000])
            elif kind == "Log.entryAdded" and said["entry"]["level"] in ("error", "warning"):
                self.errors.append(said["entry"]["text"])
            elif kind == "Network.requestWillBeSent":
                self.requests.append(said["request"]["url"][:200])

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.into], [], [], PATIENCE)
            read = self.into.read(1 << 20) if ready else b""
            if not read:
                raise RuntimeError("the browser ended, or says nothing")
            self.rest += read
        message, self.rest = self.rest.split(b"\0", 1)
        found: dict[str, Any] = json.loads(message)
        return found

    def open(self, page: Path, width: int = 1100, height: int = 800, dark: bool = False) -> None:
        """Open a file in a window of a size."""
        self.visit(page.resolve().as_uri(), width, height, dark)

    def visit(self, url: str, width: int = 1100, height: int = 800, dark: bool = False) -> None:
        """Open an address in a window of a size.

        The page before is left first: what it still asks of a server that has gone is its own.
        """
        self.look(width, height, dark)
        self._go_to("about:blank")
        self.errors.clear()
        self.requests.clear()
        self._go_to(url)

    def _go_to(self, url: str) -> None:
        self.call("Page.navigate", url=url)
        for _ in range(200):
            if self.run("document.readyState") == "complete":
                return
            time.sleep(0.05)
        raise RuntimeError(f"{url} does not come up")

    def look(self, width: int, height: int, dark: bool = False, media: str = "screen") -> None:
        """Size of the window, light or dark, screen or paper."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=False)  # fmt: skip
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", media=media, features=[scheme])

    def run(self, script: str) -> Any:
        """The value of an expression; promises are waited for."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True,
                          awaitPromise=True)  # fmt: skip
        if "exceptionDetails" in found:
            raise RuntimeError(f"{script}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def corner(self) -> list[float]:
        """Upper left of the player in the window [pixels]."""
        script = "(r => [r.x, r.y])(document.querySelector('.stage').getBoundingClientRect())"
        found: list[float] = self.run(script)
        return found

    def choose(self, name: str, value: object, event: str = "change") -> None:
        """Give a control, by its class, another value; until what follows is drawn."""
        self.run(f"(s => {{ s.value = `{value}`; s.dispatchEvent(new Event('{event}')); }})"
                 f"(document.querySelector('.{name}'))")  # fmt: skip
        self.settle()

    def out_of(self, boxes: str) -> list[str]:
        """Texts that leave the boxes of a selector."""
        script = Path(__file__).with_name("out_of_boxes.js").read_text()
        found: list[str] = self.run(script.replace("BOXES", boxes))
        return found

    def key(self, key: str) -> None:
        """Press a key."""
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=key, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=key)

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """Move or press the mouse."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, p: Sequence[float], q: Sequence[float]) -> None:
        """Press the left button at p, let go at q; until what follows is drawn."""
        self.mouse("mousePressed", *p, button="left", buttons=1, clickCount=1)
        self.mouse("mouseMoved", *q, button="left", buttons=1)
        self.mouse("mouseReleased", *q, button="left")
        self.settle()

    def settle(self) -> None:
        """Wait until what was asked for is drawn."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def picture(self, path: Path | None = None, whole: bool = False) -> bytes:
        """The window, or the whole page, as a PNG."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        picture = base64.b64decode(found["data"])
        if path:
            path.write_bytes(picture)
        return picture
