"""Text as markup: whatever is not markup already is escaped, so titles stay text."""

import base64
import html
import json
import re
from pathlib import Path
from string import Template
from typing import Any

from micstools.files import as_text

FOLDER = Path(__file__).parent
# The page may load nothing at all; the browser itself refuses what this does not allow.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
_ASKING = "; connect-src 'self'"
# Each uses those before.
_SCRIPTS = ("vectors", "water", "block_map", "stage", "overlay", "hands", "player")
_EMPTY = ("img", "input", "meta")  # have no end


class Markup(str):
    """Text that is markup."""

    __slots__ = ()


def markup(*content: object) -> Markup:
    """Everything in a row, escaped where it is not markup yet; None is left out."""
    said = [c for c in content if c is not None]
    return Markup("".join(c if isinstance(c, Markup) else html.escape(str(c)) for c in said))


def tag(name: str, /, *content: object, **attributes: object) -> Markup:
    """An element, as in `tag("p", "text", class_="note")`; an attribute that is None is left out,
    one that is True has no value."""
    said = [name]
    for key, value in attributes.items():
        word = key.rstrip("_").replace("_", "-")
        if value is True:
            said.append(word)
        elif value is not None:
            said.append(f'{word}="{html.escape(str(value))}"')
    opened = f"<{' '.join(said)}>"
    return Markup(opened if name in _EMPTY else f"{opened}{markup(*content)}</{name}>")


def section(name: str, title: str, *content: object) -> Markup:
    """A part of the page under a heading."""
    return tag("section", tag("h2", title, id=f"{name}-title"), *content, id=name,
               aria_labelledby=f"{name}-title")  # fmt: skip


def table(heads: list[object], rows: list[list[object]], numbers: bool = True,
          kind: str = "") -> Markup:  # fmt: skip
    """A table that scrolls by itself where it is wider than the window; `numbers`: all columns but
    the first are figures; `kind`: a class of its own."""
    head = tag("thead", tag("tr", *(tag("th", h, scope="col") for h in heads)))
    body = [
        tag("tr", tag("th", row[0], scope="row"), *(tag("td", cell) for cell in row[1:]))
        for row in ([_told(cell) for cell in row] for row in rows)
    ]
    kind = f"{kind} figures".strip() if numbers else kind
    return tag("div", tag("table", head, tag("tbody", *body), class_=kind or None), class_="scroll",
               tabindex=0)  # fmt: skip


def _told(cell: object) -> object:
    """A cell that a spreadsheet takes for text if it is copied there; signs begin figures."""
    name = type(cell) is str and not re.match(r"[+-] ?[\d.]", cell)
    return as_text(cell) if name else cell


def facts(pairs: list[tuple[str, object, str]]) -> Markup:
    """The few figures that matter: name, value and a word on it."""
    return tag("dl", *(
        tag("div", tag("dt", name), tag("dd", tag("b", value), " ", tag("span", note)))
        for name, value, note in pairs
    ), class_="facts")  # fmt: skip


def filled(file: str, /, folder: Path = FOLDER, **parts: object) -> Markup:
    """The markup of `file`.html with its $parts, escaped where they are not markup yet."""
    text = (folder / f"{file}.html").read_text()
    return Markup(Template(text).substitute({key: markup(part) for key, part in parts.items()}))


def download(name: str, kind: str, content: str, words: str) -> Markup:
    """A link that saves a text; it is in the page already."""
    data = base64.b64encode(content.encode()).decode()
    return tag("a", words, href=f"data:{kind};base64,{data}", download=name)


def data(name: str, content: Any) -> Markup:
    """Numbers for a script; no `<` in them can end it."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return Markup(f'<script type="application/json" id="{name}">{text}</script>')


def document(
    title: str,
    *content: object,
    script: str = "",
    more: tuple[str, ...] = (),
    head: Markup | None = None,
    wide: bool = False,
) -> str:
    """The whole page with its style and scripts, `more` of them, `script` the one that starts
    them. A page with a `head` of a server may ask that server, a `wide` one takes more room."""
    script = "".join((FOLDER / f"{name}.js").read_text() for name in (*_SCRIPTS, *more)) + script
    return filled("page", title=title, content=markup(*content), script=Markup(script), head=head,
                  policy=_POLICY + (_ASKING if head else ""), width="wide" if wide else "usual",
                  style=Markup((FOLDER / "page.css").read_text()))  # fmt: skip
