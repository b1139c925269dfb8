"""The texts of the project as pages of a site, in which names of files are links."""

import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[1]
IN_SITE = "|url|"
"""What FORD replaces by the way to the top of the site."""
SEARCHED = ("", "docs/", "src/", "verification/", "tools/")
"""Folders from which texts name files; the one of the text itself comes first."""


WRITTEN = {
    "bench.json", "build/bench.json", "ensemble.csv", "ensemble.json", "handover.json",
    "mics-roundhead/handover.json", "mics-paper-ensemble/shares.md", "landings.csv", "pile.csv",
    "pile.json", "places.csv", "places.json",
}  # fmt: skip
"""Files that the tools write, which texts name."""


@dataclass(frozen=True)
class Page:
    """A text of the project and its place in the site, without the ending."""

    source: PurePosixPath  # from the top of the project
    place: str

    @property
    def url(self) -> str:
        return f"{IN_SITE}/{self.place}.html"


def pages() -> list[Page]:
    """All texts that become pages; the README is the first page of the site."""
    cases = "verification/cases/*/README.md"
    found = []
    for path in [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob(cases)]:
        source = PurePosixPath(path.relative_to(ROOT))
        if source.name != "README.md":
            place = f"page/{path.stem.lower()}"
        else:
            place = f"page/verification/{path.parent.name}" if "cases" in source.parts else "index"
        found.append(Page(source, place))
    found.append(Page(PurePosixPath("verification/README.md"), "page/verification/index"))
    return sorted(found, key=lambda page: page.place)


class Links:
    """Where the files that texts name are found in the site."""

    def __init__(self, known: list[Page]) -> None:
        self.pages = {str(page.source): page.url for page in known}
        self.files = set(
            subprocess.run(
                ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
                cwd=ROOT, capture_output=True, text=True, check=True,
            ).stdout.split()
        )  # fmt: skip
        self.copied: set[str] = set()
        self.problems: list[str] = []

    def file(self, name: str, near: PurePosixPath) -> str | None:
        """The file of the project that a text in a folder means by a name, if there is one."""
        tried = [os.path.normpath(near / name), *(os.path.normpath(top + name) for top in SEARCHED)]
        found = next((path for path in tried if path in self.files), None)
        if found is None and "/" not in name and len(self.ending(name)) == 1:
            return self.ending(name)[0]  # a name alone, as of a module
        return found

    def ending(self, name: str) -> list[str]:
        """All files of this name, in any folder; `case.nml` is the name of many."""
        return [path for path in self.files if path.endswith(f"/{name}")]

    def url(self, file: str) -> str:
        """The page of a file, or a copy of it beside the pages."""
        path = PurePosixPath(file)
        if file in self.pages:
            return self.pages[file]
        if path.parts[0] == "src" and path.name != "mics.f90":
            return f"{IN_SITE}/module/{path.stem}_m.html"
        if path.parts[0] == "src" and path.name == "mics.f90":
            return f"{IN_SITE}/program/mics.html"
        if path.parts[:2] == ("docs", "figures"):
            return f"{IN_SITE}/media/{path.relative_to('docs/figures')}"
        self.copied.add(file)
        return f"{IN_SITE}/files/{file}"


def with_links(page: Page, text: str, links: Links) -> str:
    """The text with links that lead somewhere in the site; names of files become links, too."""

    def problem(name: str) -> None:
        links.problems.append(f"{page.source}: no such file: {name}")

    def of_link(found: re.Match[str]) -> str:
        target, _, part = found[2].partition("#")
        if not target or ":" in target:
            return found[0]
        file = links.file(target, page.source.parent)
        if file is None:
            problem(target)
            return found[0]
        return f"{found[1]}({links.url(file)}{'#' + part if part else ''})"

    def of_name(found: re.Match[str]) -> str:
        if "NAME" in found[1] or found[1] in WRITTEN:
            return found[0]
        file = links.file(found[1], page.source.parent)
        if file is None:
            if not links.ending(found[1]):
                problem(found[1])
            return found[0]
        return f"[{found[0]}]({links.url(file)})" if file != str(page.source) else found[0]

    pieces = re.split(r"(^[ \t]*```.*?^[ \t]*```$)", text, flags=re.MULTILINE | re.DOTALL)
    for i in range(0, len(pieces), 2):  # between blocks of code
        pieces[i] = re.sub(r"(\[[^]]*\])\(([^) ]+)\)", of_link, pieces[i])
        pieces[i] = re.sub(
            r"(?<!\[)`([\w./-]+\.(?:f90|md|py|nml|toml|csv|json))`(?!\])", of_name, pieces[i]
        )
    return "".join(pieces)
