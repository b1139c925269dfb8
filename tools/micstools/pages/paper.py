"""A page on A4, for a client: the same text, tables and drawings, laid out by WeasyPrint."""

import logging
import re
from pathlib import Path

from micstools import files
from micstools.pages.html import FOLDER


def write(path: Path, page: str) -> Path:
    """Write a page as PDF."""
    from weasyprint import HTML

    logging.getLogger("weasyprint").setLevel(logging.ERROR)  # what of our style it does not know
    text = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    text = re.sub(r"(<svg[^>]*>)", lambda m: m[1] + f"<style>{_drawn()}</style>", text)
    text = text.replace("</head>", f"<style>{(FOLDER / 'paper.css').read_text()}</style></head>", 1)
    files.write(path, HTML(string=text).write_pdf())
    return path


def _drawn() -> str:
    """The style of drawings for each of them: WeasyPrint gives none of the page's to what is drawn
    in it, and there what is around a drawing is no part of a selector."""
    style = (FOLDER / "page.css").read_text()
    kinds = r"(?:svg|\.(?:chart|key|share|tank|level|scale|bar)\b)"
    rules = "\n".join(re.findall(rf"^{kinds}[^{{\n]*\{{[^}}]*\}}", style, re.MULTILINE))
    rules = re.sub(r"(?:svg|\.(?:chart|key|share)) (?=[.t])", "", rules)
    colour = dict(re.findall(r"(--[\w-]+): (#\w+)", style.split("@media")[0]))
    return re.sub(r"var\((--[\w-]+)\)", lambda m: colour[m[1]], rules)
