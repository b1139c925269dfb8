"""Pages served on this machine: who is answered, a run and an ensemble watched and stopped, a case
edited, checked, run and reported, all in a browser."""

import asyncio
import fcntl
import html
import http.client
import json
import os
import re
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("aiohttp", reason="no aiohttp here: tools/deps.sh serve")

from aiohttp import web  # noqa: E402
from hypothesis import given, seed  # noqa: E402
from hypothesis import settings as settings_of_hypothesis  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

from browser import Browser  # noqa: E402
from calls import MICS, going_on, needs_mics, program, until  # noqa: E402
from micstools.cases import settings  # noqa: E402
from micstools.pages import set_up  # noqa: E402
from micstools.pages.html import Markup  # noqa: E402
from micstools.reading.reader import BadRun, Run  # noqa: E402
from micstools.serve import living, server, studio, watch  # noqa: E402
from micstools.serve.draft import Draft, typed  # noqa: E402
from micstools.serve.server import ADDRESS, TOKEN, Site  # noqa: E402
from synthetic import Motion, change, write_run  # noqa: E402
from test_pile_ensemble import write_ensemble  # noqa: E402

CASE = """! a remark that stays
&run t_end = 500  dt = 0.002  physics = 'dry'  output = 'mics-here'  title = 'Two cubes' /
&grid cells = 4, 2, 3  length = 0.4, 0.2, 0.3 /
&shape name = 'cube'  kind = 'cube'  size = 0.05 /
&body shape = 'cube'  position = 0.1, 0.1, 0.035 /
&drop shape = 'cube'  position = 0.3, 0.1, 0.2  first_time = 0.5 /
"""


@contextmanager
def serving(site: Site) -> Iterator[str]:
    """The site in a thread; the address with its key."""
    loop = asyncio.new_event_loop()
    runner = site.runner()

    async def begin() -> None:
        await runner.setup()
        await web.TCPSite(runner, ADDRESS, 0).start()
        site.port = runner.addresses[0][1]

    loop.run_until_complete(begin())
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    try:
        yield site.address()
    finally:
        asyncio.run_coroutine_threadsafe(runner.cleanup(), loop).result(20)
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


def request(site: Site, path: str, *, method: str = "GET", body: Any = None,
            known: bool = True, **headers: str) -> tuple[int, dict[str, str], str]:  # fmt: skip
    """Status, headers and text of an answer; headers with `_` for `-`."""
    link = http.client.HTTPConnection(ADDRESS, site.port, timeout=120)
    sent = {"Cookie": f"{site.cookie}={site.session}"} if known else {}
    sent |= {name.replace("_", "-"): value for name, value in headers.items()}
    link.request(method, path, json.dumps(body) if body is not None else None, sent)
    answer = link.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read().decode()
    link.close()
    return found


def post(site: Site, path: str, **body: Any) -> tuple[int, dict[str, Any]]:
    """Status and data of the answer to what a window of the site sends."""
    status, _, text = request(site, path, method="POST", body=body, **{TOKEN: site.token})
    return status, json.loads(text) if text.startswith("{") else {}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_run(tmp_path / "run", Motion(t_end=1.0))


@pytest.fixture
def run_site(folder: Path) -> Iterator[Site]:
    site = watch.site_of(folder)
    with serving(site):
        yield site


def test_nobody_else_is_answered(run_site: Site, folder: Path) -> None:
    """No name but ours, no other page, no key, no token: no answer."""
    site = run_site
    here = f"{ADDRESS}:{site.port}"
    assert request(site, "/live")[0] == 200
    assert request(site, "/live", Host=f"localhost:{site.port}")[0] == 200
    assert request(site, "/live", known=False)[0] == 403
    assert request(site, "/?key=wrong", known=False)[0] == 403
    for host in ("evil.example", f"evil.example:{site.port}", ADDRESS, f"{ADDRESS}:1"):
        assert request(site, "/live", Host=host)[0] == 421, host
    for origin in ("http://evil.example", "null", f"https://{here}"):
        assert request(site, "/live", Origin=origin)[0] == 403, origin
    assert request(site, "/live", Sec_Fetch_Site="cross-site")[0] == 403
    stop = {"method": "POST", "body": {"how": "restart"}}
    for headers in ({}, {TOKEN: "x"}, {TOKEN: site.session}):
        assert request(site, "/stop", **stop, **headers)[0] == 403, headers
    assert request(site, "/stop", **stop, **{TOKEN: site.token}, Host="evil.example")[0] == 421
    assert post(site, "/stop", how="restart")[0] == 422  # no run goes on
    assert not (folder / "stop").exists()
    assert request(site, "/stop")[0] == 405


def test_answers_allow_nothing_from_outside(run_site: Site) -> None:
    for path, wanted in (("/", 200), ("/live", 200), ("/nowhere", 404)):
        status, headers, text = request(run_site, path)
        assert status == wanted
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "connect-src 'self'" in headers["Content-Security-Policy"]
        assert not [name for name in headers if name.startswith("Access-Control")]
        assert headers["Cache-Control"] == "no-store"
        assert "http://" not in text and "https://" not in text
    assert request(run_site, "/live", known=False)[1]["X-Frame-Options"] == "DENY"


def path_of(address: str) -> str:
    return address[address.index("/?") :]


def test_a_key_lets_one_browser_in_once(run_site: Site) -> None:
    """And not after a while; the cookie is another secret."""
    site, late = run_site, path_of(run_site.address())
    site.keys = dict.fromkeys(site.keys, time.monotonic() - 1)
    first = path_of(site.address())
    assert request(site, late, known=False)[0] == 403
    status, headers, _ = request(site, first, known=False)
    assert status == 303 and headers["Location"] == "/"
    assert f"{site.cookie}={site.session};" in headers["Set-Cookie"]
    assert "HttpOnly" in headers["Set-Cookie"] and "SameSite=Strict" in headers["Set-Cookie"]
    assert site.session not in first and site.token not in first
    assert request(site, first, known=False)[0] == 403
    assert request(site, path_of(site.address()), known=False)[0] == 303


def test_the_browser_is_told_no_key(tmp_path: Path) -> None:
    """Its command line names a file that nobody else can read, and which goes after its use."""
    told = tmp_path / "told"
    script = program(
        tmp_path / "browser",
        f'#!/bin/sh\necho "$1" > {told}.new\nmv {told}.new {told}\n'
        'while [ -e "${1#file://}" ]; do sleep 0.1; done\n',
    )
    words = (sys.executable, "-m", "micstools.cli", "watch", write_run(tmp_path / "run"))
    environment = {**os.environ, "BROWSER": f"{script} %s &", "HOME": str(tmp_path)}
    with going_on(*words, env=environment, stdout=subprocess.PIPE) as process:
        until(lambda: told.exists() or process.poll() is not None)
        opened = urllib.parse.urlsplit(told.read_text().strip())
        page = Path(opened.path)
        assert opened.scheme == "file" and page.is_relative_to(tmp_path)
        assert [path.stat().st_mode & 0o777 for path in (page, page.parent)] == [0o600, 0o700]
        (address,) = re.findall(r"http://[^\"]*", page.read_text())
        key = address.split("=")[1].encode()
        for line in Path("/proc").glob("[0-9]*/cmdline"):
            with suppress(OSError):  # it has ended
                assert key not in line.read_bytes()
        keeping = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        assert keeping.open(address).status == 200
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address)
        until(lambda: not page.parent.exists())


def test_a_foreign_report_reaches_nothing(run_site: Site, folder: Path, browser: Browser) -> None:
    """Its scripts run, for ours do, but have no part in the session."""
    report = folder / "report.html"
    report.write_text(attack := Path(__file__).with_name("attack.html").read_text())
    headers = request(run_site, "/report")[1]["Content-Security-Policy"]
    assert "sandbox allow-scripts;" in headers and "connect-src 'none'" in headers
    browser.visit(run_site.address())
    browser.run("location.assign('/report')")
    until(lambda: browser.run("location.pathname") == "/report")
    until(lambda: browser.run("document.title") != "foreign")
    assert browser.run("document.title") == "refused"
    assert report.read_text() == attack
    assert all("Content Security Policy" in error for error in browser.errors)
    browser.errors.clear()


def test_a_private_file_leads_to_the_page(run_site: Site, browser: Browser, tmp_path: Path) -> None:
    """As a link of another page would, which must not keep the cookie back."""
    page = tmp_path / "open.html"
    page.write_text(server._forward(run_site.address()))
    browser.visit(page.as_uri())
    until(lambda: browser.run("location.pathname + location.search") == "/")
    until(lambda: browser.run("typeof live !== 'undefined' && live.player.stage.scene && true"))


def test_only_loopback_listens(run_site: Site) -> None:
    with socket.socket() as link:
        link.settimeout(2)
        assert link.connect_ex(("127.0.0.2", run_site.port)) != 0


def send(site: Site, content: bytes, patience: float = 60) -> bytes:
    """What comes back of raw bytes, with cookie and token."""
    ours = f"Cookie: {site.cookie}={site.session}\r\n{TOKEN}: {site.token}\r\n"
    with socket.create_connection((ADDRESS, site.port), patience) as link:
        link.sendall(content.replace(b"OURS", f"Host: {ADDRESS}:{site.port}\r\n{ours}".encode()))
        return b"".join(iter(lambda: link.recv(1 << 16), b""))


def posted(body: bytes, length: int | None = None) -> bytes:
    size = len(body) if length is None else length
    head = f"POST /stop HTTP/1.1\r\nOURSConnection: close\r\nContent-Length: {size}\r\n\r\n"
    return head.encode() + body


@pytest.mark.parametrize(
    "body",
    [b"", b"{", b"[1]", b'"x"', b"\xff\xfe", b"[" * 100_000, b'{"how": NaN}',
     b'{"how": "\\ud800"}'],
)  # fmt: skip
def test_a_broken_request_is_told_in_a_line(run_site: Site, body: bytes) -> None:
    answer = send(run_site, posted(body))
    assert answer.startswith(b"HTTP/1.1 400 ")
    assert answer.endswith((b"the request is no JSON", b"the request is no object"))


def test_huge_odd_and_slow_requests_are_refused(
    run_site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert send(run_site, posted(b"1" * 8_000_001)).startswith(b"HTTP/1.1 413 ")
    for cookie in ("\udcff", "a=b; ;;=", f"{run_site.cookie}=\xff\udc80"):
        headers = f"Host: {ADDRESS}:{run_site.port}\r\nCookie: {cookie}\r\nConnection: close"
        raw = f"GET / HTTP/1.1\r\n{headers}\r\n\r\n".encode("utf-8", "surrogateescape")
        assert send(run_site, raw).startswith((b"HTTP/1.1 403 ", b"HTTP/1.1 400 ")), cookie
    monkeypatch.setattr(server, "_PATIENCE", 0.3)
    assert send(run_site, posted(b"{", 10)).startswith(b"HTTP/1.1 408 ")


def test_a_client_that_says_nothing_is_let_go(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "_PATIENCE", 0.3)
    site = watch.site_of(folder)
    with serving(site):
        assert send(site, b"") == send(site, b"GET / HTTP/1.1\r\nHost:") == b""


_lines = st.text(st.characters(codec="latin-1"), max_size=30).map(lambda s: s.encode("latin-1"))
_ways = st.sampled_from(b"/ /live /scene?run= /stop /report /% /\x00 *".split())


def attack_with_requests(site: Site, n: int, number: int = 1) -> None:
    """Whatever comes is answered, or the connection is closed; never with 500."""

    @seed(number)
    @given(st.sampled_from([b"GET", b"POST", b"PUT", b"\x00"]), _ways, _lines,
           st.lists(st.tuples(_lines, _lines), max_size=3), st.binary(max_size=40))  # fmt: skip
    @settings_of_hypothesis(max_examples=n, deadline=None, database=None)
    def attack(
        verb: bytes, way: bytes, more: bytes, heads: list[tuple[bytes, bytes]], body: bytes
    ) -> None:
        lines = b"".join(name + b": " + said + b"\r\n" for name, said in heads)
        size = b"Content-Length: %d\r\n" % len(body)
        content = verb + b" " + way + more + b" HTTP/1.1\r\nOURS" + size + lines
        answer = send(site, content + b"Connection: close\r\n\r\n" + body, 10)
        assert answer == b"" or answer[9:12] in (
            b"200", b"400", b"403", b"404", b"405", b"411", b"413", b"421", b"422", b"501",
        ), (content, answer)  # fmt: skip

    attack()


def test_no_request_is_a_fault(run_site: Site) -> None:
    attack_with_requests(run_site, 200)


def test_a_run_that_was_killed_does_not_run(folder: Path) -> None:
    change(folder, "provenance", "exit_status", value=-1)
    (folder / "run.lock").write_text(f"pid {os.getpid()} on {os.uname().nodename}")
    found = living.state(Run(folder))
    assert (found.words, found.running) == ("was killed", False)
    with pytest.raises(BadRun, match="no run is going on"):
        living.ask_to_stop(folder)
    with (folder / "run.lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = living.state(Run(folder))
        assert (found.words, found.running) == ("running", True)
        before = living.holder(folder / "run.lock")
        assert living.ask_to_stop(folder) and (folder / "stop").exists()
    assert living.state(Run(folder), before).running  # it ended since that was looked at


def test_another_program_is_not_stopped(folder: Path) -> None:
    """Whom a lock file names may be anybody: nothing is sent to a process that does not hold it."""
    with going_on("sleep", "60") as other, (folder / "run.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for pid in (other.pid, os.getpid(), 999_999_999):
            lock.seek(0)
            lock.write(f"pid {pid} on {os.uname().nodename}\n")
            lock.flush()
            with pytest.raises(BadRun, match="is another program|cannot be reached"):
                living.stop_at_once(folder)
        assert other.poll() is None


def test_an_ensemble_is_told_to_stop_by_its_process(tmp_path: Path) -> None:
    words = "import fcntl, sys, time; fcntl.flock(f := open(sys.argv[1]), 2); print(1, flush=True)"
    lock = tmp_path / "ensemble.lock"
    lock.write_text("")
    call = [sys.executable, "-c", words + "; time.sleep(60)", str(lock)]
    holder = subprocess.Popen(call, stdout=subprocess.PIPE)
    assert holder.stdout and holder.stdout.readline() == b"1\n"
    lock.write_text(f"{holder.pid} on {os.uname().nodename}\n")
    assert "same command goes on" in living.stop_ensemble(tmp_path, [])
    assert holder.wait(120) == -15
    assert living.stop_ensemble(tmp_path, []) == "0 runs asked to stop"


def test_the_time_left_is_that_of_the_last_rows() -> None:
    time = np.concatenate([np.linspace(0, 1, 50), np.linspace(1.1, 3, 20)])
    wall = np.concatenate([np.linspace(0, 1, 50), 10 + 20 * np.linspace(1.1, 3, 20)])
    assert living._left(time, wall, 5.0) == pytest.approx(40.0)
    assert living.clock(3725.4) == "1:02:05" and living.clock(float("nan")) == "–"


def test_few_rows_are_read_of_a_long_run(folder: Path) -> None:
    whole, few = Run(folder).bodies, Run(folder, most=10).bodies
    assert len(few.time) <= 11 and few.time[-1] == whole.time[-1] and few.time[0] == 0
    assert few.position[-1].tolist() == whole.position[-1].tolist()
    assert few.release_time.tolist() == whole.release_time.tolist()


def test_a_check_that_does_not_end_is_refused(tmp_path: Path) -> None:
    slow = program(tmp_path / "mics", "#!/bin/sh\nexec sleep 60\n")
    with (
        pytest.raises(set_up.Refused, match=r"the check takes more than 0.2 s"),
        set_up.read(slow, CASE, 0.2),
    ):
        pass


def test_a_damaged_run_is_told_on_its_page(folder: Path) -> None:
    (folder / "run.h5").write_bytes(b"<b>")
    found = watch.Watched(folder).parts()
    assert f"{folder}/run.h5: cannot be read" in found["parts"]["state"] and not found["running"]


@contextmanager
def begun(folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A run of the program that takes long, once its first rows are there."""
    (folder / "case.nml").write_text(CASE)
    words = (MICS, "--quiet", "--threads", "1", "case.nml")
    with going_on(*words, cwd=folder, stderr=subprocess.DEVNULL) as process:
        until(lambda: (folder / "mics-here" / "run.h5").is_file())
        yield process


@needs_mics
def test_a_run_is_watched_and_stopped(tmp_path: Path, browser: Browser) -> None:
    folder = tmp_path / "mics-here"
    with begun(tmp_path) as process, serving(watch.site_of(folder)) as address:
        browser.visit(address)
        share = "+(document.querySelector('[data-live=bar] progress') || {}).value || 0"
        first = until(lambda: browser.run(share))
        assert until(lambda: browser.run(share) > first)
        until(lambda: browser.run("live.player.stage.scene && live.player.stage.times.length"))
        assert "Running at t" in browser.run("document.body.innerText")
        assert "left at this pace" in browser.run("document.body.innerText")
        browser.run("live.player.stage.yaw = 1.0")  # the view stays when more comes
        end = browser.run("live.player.stage.time")
        until(lambda: browser.run("live.player.stage.time") > end)
        assert browser.run("live.player.stage.yaw") == 1.0
        browser.run("document.querySelector('[data-stop=restart]').click()")
        assert process.wait(120) == 143
        assert (folder / "restart-a.h5").is_file() and not (folder / "stop").exists()
        until(lambda: "Stopped at t" in browser.run("document.body.innerText"))
        assert browser.run("document.querySelectorAll('.chart .curve').length") > 3
        assert outside(browser, address) == []


@needs_mics
def test_a_run_is_stopped_at_once(tmp_path: Path, browser: Browser) -> None:
    """After a question; what was written stays."""
    folder = tmp_path / "mics-here"
    with begun(tmp_path) as process, serving(watch.site_of(folder)) as address:
        browser.visit(address)
        browser.run("document.querySelector('[data-ask]').click()")
        assert browser.run("document.getElementById('sure').open")
        browser.run("document.querySelector('#sure .close').click()")
        assert process.poll() is None
        browser.run("document.querySelector('[data-ask]').click()")
        browser.run("document.querySelector('[data-stop=now]').click()")
        assert process.wait(120) == -9
        until(lambda: "Was killed at t" in browser.run("document.body.innerText"))
        assert Run(folder).bodies.time.size


def test_an_ensemble_is_watched(tmp_path: Path, browser: Browser) -> None:
    folder = write_ensemble(tmp_path / "piles")
    about = json.loads((folder / "ensemble.json").read_text())
    for row in about["table"]:
        (folder / str(row["folder"])).mkdir(exist_ok=True)
        (folder / str(row["folder"]) / "case.nml").write_text(about["case"])
    result = folder / "0001" / "result"
    change(result, "provenance", "exit_status", value=-1)
    (result / "run.lock").write_text(f"pid {os.getpid()} on {os.uname().nodename}")
    site = watch.site_of(folder)
    with (result / "run.lock").open() as lock, serving(site) as address:
        fcntl.flock(lock, fcntl.LOCK_EX)
        browser.visit(address)
        text = "document.body.innerText"
        until(lambda: "runs done" in browser.run(text))
        said = " ".join(browser.run(text).split())
        assert "5 of 7 runs done, one run goes on." in said
        assert "5 (100 %," in said and "1 running, 1 missing" in said
        assert "running" in browser.run("document.querySelector('[data-live=runs]').innerText")
        browser.run("document.querySelector('[data-run=\"2\"]').click()")
        until(lambda: browser.run("live.player.stage.scene && true"))
        assert browser.run("live.player.stage.scene.bodies.length") == 4
        assert post(site, "/stop", how="restart")[0] == 200 and (result / "stop").exists()
        assert not (folder / "0002" / "result" / "stop").exists()
        assert outside(browser, address) == []


def outside(browser: Browser, address: str) -> list[str]:
    """What the page asked of anybody but the server."""
    ours = address.split("?")[0]
    return [url for url in browser.requests if not url.startswith((ours, "data:"))]


@pytest.mark.parametrize(("width", "dark"), [(360, False), (1100, True)])
def test_a_page_to_watch_fits(run_site: Site, browser: Browser, width: int, dark: bool) -> None:
    browser.visit(run_site.address(), width, 740, dark)
    until(lambda: browser.run("live.player.stage.scene && true"))
    assert browser.run("document.documentElement.scrollWidth") <= width


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file of two cubes, in the folder in which the tests of a studio run."""
    if not os.access(MICS, os.X_OK):
        pytest.skip("./mics is not built")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.nml").write_text(CASE)
    return tmp_path / "case.nml"


@pytest.fixture
def draft(case: Path) -> Draft:
    return Draft(case, MICS)


def test_a_change_keeps_the_rest(draft: Draft) -> None:
    """Remarks stay; what was there before comes back, step by step."""
    draft.edit({"op": "set", "group": "grid", "n": 0, "variable": "length", "value": "1, 2, 3"})
    draft.edit({"op": "set", "group": "drop", "n": 0, "variable": "first_time", "value": ""})
    draft.edit({"op": "copy", "group": "drop", "n": 0})
    draft.edit({"op": "set", "group": "drop", "n": 1, "variable": "count", "value": "3"})
    assert draft.text.startswith("! a remark that stays\n&run t_end = 500  dt = 0.002")
    assert settings.value(draft.text, "grid", "length") == [1, 2, 3]
    assert settings.value(draft.text, "drop", "first_time") is None
    assert [settings.value(draft.text, "drop", "count", n) for n in (0, 1)] == [None, 3]
    for _ in range(4):
        draft.edit({"op": "undo"})
    assert draft.text == CASE and draft.state()["saved"]
    with pytest.raises(BadRun, match="no such variable"):
        draft.edit({"op": "set", "group": "grid", "n": 0, "variable": "x) /", "value": "1"})
    with pytest.raises(BadRun, match="no change 'burn'"):
        draft.edit({"op": "burn"})


def test_every_group_can_be_added(draft: Draft) -> None:
    for group in draft.groups:
        if "anyOf" in draft.schema["properties"][group] or group not in draft.text:
            draft.edit({"op": "add", "group": group})
    assert [g for g, _, _ in draft.values() if g not in draft.groups] == []
    problems = draft.look()["problems"]
    assert [p["text"] for p in problems if p["group"] not in ("bed", "start")] == []  # name files


def test_every_task_is_a_case_of_its_own(draft: Draft) -> None:
    """Which the program accepts from any folder; its results have a folder of their own."""
    page = studio.frame(draft, Markup(), False)
    for task in re.findall(r"value='(\{.*?\})'", page):
        draft.edit({"op": "new", **json.loads(task)})
        assert draft.look()["problems"] == []
        assert settings.value(draft.text, "run", "output") == "mics-case"
    assert f"file = '{MICS.parent}/input/reef.csv'" in draft.text
    draft.edit({"op": "undo"})
    assert "physics = 'dry'" in draft.text
    with pytest.raises(OSError, match=r"input/b\.nml"):
        draft.edit({"op": "new", "case": "../a/b"})


def test_the_table_of_physics_is_that_of_the_readme(draft: Draft) -> None:
    rows = (MICS.parent / "README.md").read_text().split("## Which physics")[1].split("\n## ")[0]
    wanted = re.findall(r"^\| (.*?) \| `'(\w+)'` \| (.*?) \|", rows, re.MULTILINE)
    shown = studio.frame(draft, Markup(), False)
    assert re.findall("<tr><td>(.*?)</td><td>(.*?)</td><td>(.*?)</td>", shown) == wanted
    assert len(wanted) == 4


def test_the_program_judges_what_is_typed(draft: Draft) -> None:
    draft.edit({"op": "set", "group": "shape", "n": 0, "variable": "size", "value": "big"})
    (problem, *_) = draft.look()["problems"]
    assert (problem["group"], problem["variable"], problem["occurrence"]) == ("shape", "size", 0)
    assert problem["short"] and not problem["short"].startswith("&")
    draft.edit({"op": "undo"})
    assert draft.look()["problems"] == []
    assert draft.bodies == [("body", 0), ("drop", 0)]
    draft.edit({"op": "move", "body": 1, "by": [0.0123456, 0, -0.05]})
    assert settings.value(draft.text, "drop", "position") == [0.3123, 0.1, 0.15]


def test_a_case_of_somebody_else_is_not_overwritten(draft: Draft) -> None:
    draft.edit({"op": "set", "group": "run", "n": 0, "variable": "t_end", "value": "2"})
    draft.case.write_text(CASE + "! from an editor\n")
    with pytest.raises(BadRun, match="changed by another program"):
        draft.save()
    assert draft.case.read_text().endswith("! from an editor\n")
    draft.case.write_text(CASE)
    draft.save()
    assert "t_end = 2" in draft.case.read_text() and draft.state()["saved"]
    draft.edit({"op": "text", "text": CASE.replace(" = ", "\u00a0= ")})  # as pasted from a page
    assert draft.save() == draft.save()


def test_one_run_at_a_time(case: Path) -> None:
    site = studio.site_of(case, MICS)
    lock = case.parent / "mics-here" / "run.lock"
    with serving(site), ThreadPoolExecutor(2) as windows:
        status, headers, _ = request(site, "/watch")
        assert (status, headers["Location"]) == (303, "/")
        asked = [windows.submit(post, site, "/run", number=0) for _ in range(2)]
        assert sorted(window.result()[0] for window in asked) == [200, 422]
        until(lambda: living.holder(lock))
        assert post(site, "/stop", how="now")[0] == 200
        until(lambda: living.holder(lock) is None)


def test_a_case_is_repeated_and_handed_over(case: Path) -> None:
    """As by the commands, with their refusals; then one run has its places and its PDF."""
    case.write_text(CASE.replace("t_end = 500", "t_end = 0.02"))
    site = studio.site_of(case, MICS)

    def live() -> dict[str, Any]:
        found: dict[str, Any] = json.loads(request(site, "/live")[2])
        return {} if found["running"] else found["parts"]

    with serving(site):
        assert post(site, "/repeat", number=0, runs="x")[0] == 400
        assert post(site, "/repeat", number=0, runs="2")[0] == 200
        assert "nothing is left to chance" in until(live)["log"]
        assert post(site, "/repeat", number=0, runs="2", spread="0.01", threads=1)[0] == 200
        assert "2 of 2 runs done" in until(live)["state"]
        assert 'data-run="1"' in live()["runs"] and 'id="pdf"' in request(site, "/watch")[2]
        assert post(site, "/run", number=0, threads="1")[0] == 200
        assert "Finished" in until(live)["state"]
        assert Run(case.parent / "mics-here").provenance["threads"] == 1
        for path, name in (("/places", "places.dxf"), ("/pdf", "report.pdf")):
            status, said = post(site, path)
            assert status == 200 and f"mics-here/{name}" in said["told"], said
            assert (case.parent / "mics-here" / name).is_file()


def test_a_studio_begun_anew_goes_on(case: Path) -> None:
    """It finds the run that another one began, stops it and goes on with it, from any folder."""
    folder = case.parent / "mics-here"
    case.write_text(CASE.replace("mics-here", str(folder)))
    with serving(site := studio.site_of(case, MICS)):
        assert post(site, "/run", number=0)[0] == 200
        until(lambda: (folder / "run.h5").is_file() and Run(folder).bodies.time.size)
    os.chdir(case.parent.parent)
    with serving(site := studio.site_of(case, MICS)):
        assert 'href="/watch"' in request(site, "/")[2]
        assert json.loads(request(site, "/live")[2])["running"]
        assert request(site, "/watch")[0] == 200 and post(site, "/run", number=0)[0] == 422
        assert post(site, "/stop", how="restart")[0] == 200
        until(lambda: living.holder(folder / "run.lock") is None)
    with serving(site := studio.site_of(case, MICS)):
        assert "Stopped at t" in told(site)
        other = {"group": "run", "n": 0, "variable": "output", "value": "other"}
        assert post(site, "/edit", op="set", number=0, **other)[0] == 200
        assert post(site, "/save", number=1)[0] == 200
        assert post(site, "/go-on")[0] == 200  # where it stopped
        until(lambda: "Running at t" in told(site))
        until(lambda: living.holder(folder / "run.lock"))
        assert post(site, "/run", number=1)[0] == 422
        assert post(site, "/stop", how="now")[0] == 200


def told(site: Site) -> str:
    return str(json.loads(request(site, "/live")[2])["parts"]["state"])


def test_older_results_are_not_those_of_a_new_run(case: Path, tmp_path: Path) -> None:
    """Its program has not begun, is stopped, or dies before."""
    case.write_text(CASE.replace("t_end = 500", "t_end = 0.02"))
    first = tmp_path / "first"
    text = f'#!/bin/sh\n[ "$1" = --quiet ] && . {first}\nexec {MICS} "$@"\n'
    with serving(site := studio.site_of(case, program(tmp_path / "mics", text))):
        for does, says in (("", "Finished"), ("exec sleep 99", "Waiting"), ("exit 5", "code 5")):
            first.write_text(does)
            assert post(site, "/run", number=0)[0] == 200
            until(lambda: says in told(site))  # noqa: B023
            if says == "Waiting":
                assert "before it begins" in post(site, "/stop", how="now")[1]["told"]
                until(lambda: "code -15" in told(site))


ODD = ["two words", "it's", 'a "b"', "a;touch b", "$(touch b)", "`touch b`", "a&b", "<b>", "ä\\n"]


@pytest.mark.parametrize("name", ODD)
def test_the_words_to_go_on_can_be_pasted(name: str, tmp_path: Path) -> None:
    folder = write_run(tmp_path / name, Motion(t_end=0.1))
    (folder / "restart-a.h5").touch()
    change(folder, "provenance", "exit_status", value=143)
    shown = str(watch.Watched(folder).parts()["parts"]["state"])
    (words,) = re.findall("<code>(.*)</code>", shown)
    assert "<" not in words
    call = ["sh", "-c", "printf '%s\\n' " + html.unescape(words)]
    said = subprocess.run(call, capture_output=True, text=True)
    wanted = ["mics-tools", "run", "CASE", "--restart", str(folder / "restart-a.h5")]
    assert said.stdout == "".join(f"{word}\n" for word in wanted)


def test_a_change_of_an_older_text_is_not_made(case: Path) -> None:
    """Whoever sends it gets the newest one, and nothing is lost."""
    site = studio.site_of(case, MICS)
    with serving(site):
        status, state = post(site, "/edit", op="copy", group="drop", n=0, number=0)
        assert status == 200 and state["number"] == 1
        late = {"group": "drop", "n": 0, "variable": "count", "value": "7"}
        for number in (0, 2, None, "1"):
            status, said = post(site, "/edit", op="set", number=number, **late)
            assert (status, said["state"]) == (409, state)
            for path in ("/save", "/run"):
                assert post(site, path, number=number)[0] == 409
        assert case.read_text() == CASE
        assert post(site, "/edit", op="set", number=1, **late)[1]["number"] == 2
        assert post(site, "/edit", op="set", number=2, **late | {"n": "x"})[0] == 400
        assert post(site, "/edit", op="text", number=2, text="a\0b")[0] == 422
        assert post(site, "/save", number=2)[0] == 200 and "count = 7" in case.read_text()


def test_what_is_typed_has_the_type_of_its_variable() -> None:
    text = {"type": "string"}
    assert typed(text, "10", "run.title") == "10" and typed(text, "'a, b'", "run.title") == "a, b"
    assert typed({"type": "number"}, "1d-3", "run.dt") == 1e-3
    assert typed({"type": "array", "items": {"type": "number"}}, "1, 2,", "a.b") == [1, 2]
    assert typed({"type": "array", "items": {"type": "string"}}, "'a', b", "a.b") == ["a", "b"]
    assert typed({"type": "boolean"}, ".true.", "a.b") is True


def field(name: str) -> str:
    return f"document.getElementById('{name}')"


def type_into(browser: Browser, name: str, words: str) -> None:
    """Types into an empty field of the form, letter by letter."""
    browser.run(f"{field(name)}.value = ''; {field(name)}.focus()")
    for letter in words:
        browser.key(letter)


VERDICT = "document.getElementById('verdict').textContent"
# the text as saved comes a second late
LATE = """const now = ask; var late; ask = async (...order) => { const said = await now(...order);
if (order[0] === 'draft') late = await new Promise(d => setTimeout(d, 999, true)); return said; }"""


def test_a_case_is_edited_run_stopped_and_reported(case: Path, browser: Browser) -> None:
    folder = case.parent / "mics-here"
    with serving(studio.site_of(case, MICS)) as address:
        browser.visit(address, 1200, 900)
        until(lambda: browser.run(VERDICT).startswith("Accepted"))
        fields = "document.querySelectorAll('#form select, #form input')"
        assert browser.run(f"{fields}[0].id") == "run-0-physics"
        assert "40 units: ten seconds" in browser.run(f"{field('form')}.textContent")
        type_into(browser, "shape-0-size", "big")
        until(lambda: browser.run(VERDICT).startswith("Refused"))
        assert "number" in browser.run(f"{field('shape-0-size-wrong')}.textContent")
        assert browser.run(f"{field('shape-0-size')}.getAttribute('aria-invalid')") == "true"
        assert browser.run(f"{field('run')}.disabled && {field('repeats')}.disabled")
        dim = "+getComputedStyle(document.querySelector('.player')).opacity"
        assert browser.run(dim) < 0.5 and not browser.run(f"{field('older')}.hidden")
        browser.run("document.querySelector('#problems .line').click()")
        chosen = "(t => t.value.slice(t.selectionStart, t.selectionEnd))"
        assert browser.run(f"{chosen}({field('text')})").endswith("size = 'big' /")
        assert browser.run("studio.lineOf('drop', 'first_time', 6)") == 6
        assert browser.run("studio.lineOf('drop', '', 0)") == 6
        browser.run("document.querySelector('[data-show=form]').click()")
        type_into(browser, "shape-0-size", "0.06")
        until(lambda: browser.run(VERDICT).startswith("Accepted"))
        assert browser.run(f"{field('shape-0-size-wrong')}.textContent") == ""
        assert browser.run(dim) == 1 and browser.run(f"{field('older')}.hidden")
        assert "size = 0.06" in browser.run(f"{field('text')}.value")
        assert case.read_text() == CASE  # nothing is written before it is asked for

        browser.run("document.querySelector('[data-view=front]').click()")
        browser.run("document.querySelector('.stage').scrollIntoView({ block: 'center' })")
        browser.settle()
        left, top = browser.corner()
        seen = "studio.player.stage.overlay.at(studio.player.stage.pose(1).place)"
        x, y = browser.run(f"(p => [p.x, p.y])({seen})")
        browser.drag((left + x, top + y), (left + x - 60, top + y))
        value = f"+{field('drop-0-position')}.value.split(',')[0]"
        until(lambda: browser.run(value) < 0.29)
        until(lambda: browser.run(VERDICT).startswith("Accepted"))

        browser.run("document.querySelector('[data-add=drop]').click()")
        until(lambda: browser.run(f"{field('drop-1-count')} && true"))
        browser.run("document.querySelector('[data-remove=drop][data-n=\"1\"]').click()")
        until(lambda: browser.run(f"{field('drop-1-count')} === null"))
        until(lambda: browser.run(VERDICT).startswith("Accepted"))
        browser.run(f"{field('runs')}.value = 0")  # no matter of one run
        browser.run(f"{field('run')}.click()")
        until(lambda: browser.run("location.pathname") == "/watch")
        until(lambda: "Running at t" in browser.run("document.body.innerText"))
        assert "size = 0.06" in case.read_text() and case.read_text().startswith("! a remark")
        browser.run("document.querySelector('[data-stop=restart]').click()")
        until(lambda: "Stopped at t" in browser.run("document.body.innerText"))
        assert (folder / "restart-a.h5").is_file()
        stopped = Run(folder).series.time[-1]
        browser.run("document.getElementById('go-on').click()")
        until(lambda: Run(folder).series.time[-1] > stopped)
        until(lambda: "Running at t" in browser.run("document.body.innerText"))
        browser.run("document.querySelector('[data-stop=restart]').click()")
        until(lambda: "Stopped at t" in browser.run("document.body.innerText"))
        assert outside(browser, address) == []
        browser.run("document.getElementById('report').click()")
        until(lambda: browser.run("location.pathname") == "/report")
        until(lambda: browser.run("typeof runPlayer !== 'undefined' && true"))
        assert browser.run("document.querySelector('h1').textContent") == "Two cubes"
        assert (folder / "report.html").is_file()
        assert outside(browser, address) == []


def test_two_windows_lose_nothing(case: Path, tmp_path: Path, browser: Browser) -> None:
    """What was typed just before Save is saved; over a change of another window one chooses."""
    site = studio.site_of(case, MICS)

    def saved(window: Browser, text: str) -> None:
        window.run(f"{field('save')}.click()")
        until(lambda: case.read_text() == text, 20)

    with serving(site) as address, Browser(tmp_path / "other") as other:
        for window, begin in ((browser, address), (other, site.address())):
            window.visit(begin, 1200, 900)
            until(lambda: window.run(VERDICT).startswith("Accepted"))  # noqa: B023
        browser.run("document.querySelector('[data-show=text]').click()")
        browser.run(f"{field('text')}.focus()")
        browser.run(f"{field('text')}.setSelectionRange(0, 0)")
        browser.key("!")
        saved(browser, "!" + CASE)

        type_into(other, "shape-0-size", "0.04")
        until(lambda: other.run("document.getElementById('stale').open"))
        other.run("document.querySelector('#stale [value=theirs]').click()")
        until(lambda: "is shown" in other.run(f"{field('told')}.textContent"))
        assert other.run(f"{field('text')}.value") == "!" + CASE
        assert other.run(f"{field('shape-0-size')}.value") == "0.05"
        type_into(other, "shape-0-size", "0.04")
        saved(other, "!" + CASE.replace("size = 0.05", "size = 0.04"))

        browser.key("!")
        until(lambda: browser.run("document.getElementById('stale').open"))
        browser.run("document.querySelector('#stale [value=mine]').click()")
        until(lambda: not browser.run("document.getElementById('stale').open"))
        browser.run(LATE)
        saved(browser, "!!" + CASE)
        browser.run("document.activeElement.blur()")
        browser.run(f"{field('undo')}.click()")
        browser.run(f"{field('undo')}.click()")
        until(lambda: browser.run("late"))
        until(lambda: "size = 0.04" in browser.run(f"{field('text')}.value"))
        assert [e for e in browser.errors + other.errors if "409" not in e] == []
        browser.errors.clear()


@needs_mics
def test_a_studio_fits_a_phone(tmp_path: Path, browser: Browser) -> None:
    with serving(studio.site_of(tmp_path / "new.nml", MICS)) as address:
        browser.visit(address, 360, 740, True)
        until(lambda: browser.run(VERDICT).startswith("Accepted"))
        browser.choose("tasks", '{ "case": "hopper" }')
        until(lambda: browser.run("studio.player.stage.scene.bodies.length") > 20)
        assert "Rock from a split hopper" in browser.run(f"{field('text')}.value")
        type_into(browser, "grid-0-cells", "1")
        until(lambda: browser.run(VERDICT).startswith("Refused"))
        assert browser.run("document.documentElement.scrollWidth") <= 360
        assert not (tmp_path / "new.nml").exists()
