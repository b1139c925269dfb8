"""Follow every link of a folder of HTML pages.

usage: python tools/check_links.py FOLDER

A link must lead to a file in the folder, and to a part of a page that is there. What a page loads
(styles, scripts, pictures) must be there, too, not on a server; other servers are not asked whether
a link to them leads somewhere. Exit code 1: a broken link.
"""

import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links of a page, what it loads, and the names of its parts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.loaded: set[str] = set()
        self.parts: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what a tag names and where it leads."""
        values = {name: value for name, value in attrs if value is not None}
        self.parts |= {values[name] for name in ("id", "name") if name in values}
        if "href" in values:
            (self.loaded if tag == "link" else self.links).add(values["href"])
        if "src" in values:
            self.loaded.add(values["src"])


@cache
def page_of(path: Path) -> Page:
    """The links and parts of a file."""
    return Page(path.read_text(errors="replace"))


def broken_links(folder: Path) -> list[str]:
    """A line for each link that leads nowhere, and for each thing loaded from a server."""
    folder = folder.resolve()
    return [
        f"{path.relative_to(folder)}: {reason}: {link}"
        for path in sorted(folder.rglob("*.html"))
        for link in sorted(page_of(path).links | page_of(path).loaded)
        if (reason := trouble(folder, path, link))
    ]


def trouble(folder: Path, path: Path, link: str) -> str:
    """What is wrong with a link of a page; empty if nothing is."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return (
            "loaded from a server"
            if link in page_of(path).loaded and parts.scheme != "data"
            else ""
        )
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if target.is_dir():
        target /= "index.html"
    if not target.is_file() or not target.is_relative_to(folder):
        return "no such file"
    if not parts.fragment or target.suffix != ".html":
        return ""
    return "" if unquote(parts.fragment) in page_of(target).parts | {"top"} else "no such part"


def main() -> int:
    """Check the folder that the command line names."""
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    found = broken_links(Path(sys.argv[1]))
    print("\n".join(found) or "every link leads somewhere")
    return min(len(found), 1)


if __name__ == "__main__":
    sys.exit(main())
