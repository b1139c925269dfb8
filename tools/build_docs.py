"""Build the browsable documentation: the pages of the project and its modules, from their comments.

usage: python tools/build_docs.py [--out build/docs]      (`make docs`)

README, CHANGELOG, docs/ and verification/ become pages, names of files in them links; FORD makes
the pages of the modules. Formulas become MathML; what FORD fetches from servers is put beside the
pages. At the end every link is followed. Exit code 1: a link, name or formula is wrong.
"""

import argparse
import html
import re
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath

import mkdocs
from latex2mathml.converter import convert

from check_links import broken_links
from doc_pages import ROOT, Links, Page, pages, with_links

HERE = Path(__file__).parent
# FORD takes a comment that begins with a word and a colon, like `0: off`, for its own settings; our
# comments hold none.
RUN_FORD = """
import ford, ford.utils
ford.utils.meta_preprocessor = lambda lines: ({}, list(lines))
ford.run()
"""
LOCAL = {  # what FORD fetches, and where it lies in the package mkdocs
    "css/bootstrap.min.css": "themes/mkdocs/css/bootstrap.min.css",
    "js/bootstrap.bundle.min.js": "themes/mkdocs/js/bootstrap.bundle.min.js",
    "js/lunr.js": "contrib/search/templates/search/lunr.js",
}


def write_pages(known: list[Page], links: Links, out: Path) -> Path:
    """Write what FORD reads into a folder; the file with its settings."""
    folder = out / "pages"
    first = ""
    for page in known:
        text = with_links(page, (ROOT / page.source).read_text(), links)
        if page.place == "index":
            first = text.partition("\n")[2]  # FORD writes the title itself
            continue
        title, _, rest = text.partition("\n")
        path = folder / f"{page.place.removeprefix('page/')}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"---\ntitle: {title.lstrip('# ')}\n---\n[TOC]\n{rest}")
    top = [f"- [{page.source}]({page.url})" for page in known if "cases/" not in str(page.source)]
    (folder / "index.md").write_text("\n".join(["---", "title: Documents", "---", "", *top, ""]))
    settings = out / "ford.md"
    given = (HERE / "ford.md").read_text()
    given = given.format(root=ROOT, site=out / "site", pages=folder, style=HERE / "ford.css")
    settings.write_text(given + first)
    return settings


def run_ford(settings: Path, site: Path) -> list[str]:
    """Make the pages; what FORD complains about, an entity exported again left out."""
    done = subprocess.run(
        [sys.executable, "-c", RUN_FORD, str(settings)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    (site.parent / "ford.log").write_text(done.stdout + done.stderr)
    if done.returncode:
        return [f"FORD ended with code {done.returncode}:\n{(done.stdout + done.stderr)[-3000:]}"]
    words = " ".join((done.stdout + done.stderr).split())
    return [
        f"FORD: {warning}"
        for warning in re.findall(r"Warning: (.*?)(?= Warning:|  | [^\w\s]?━|$)", words)
        if not warning.startswith("Unknown entity")
    ]


def finish_page(page: Path, site: Path) -> list[str]:
    """Put formulas into a page, and local files where it would ask servers; formulas that fail."""
    problems = []

    def formula(found: re.Match[str]) -> str:
        try:
            return str(
                convert(html.unescape(found[2]).strip(), display="block" if found[1] else "inline")
            )
        except Exception as error:  # whatever the parser has for a formula it cannot follow
            problems.append(f"{page.relative_to(site)}: formula {found[2].strip()!r}: {error!r}")
            return found[0]

    text = page.read_text()
    text = re.sub(
        r'<script type="math/tex(; mode=display)?">(.*?)</script>', formula, text, flags=re.DOTALL
    )
    text = text.replace("#moduleprocedure-", "#proc-")  # as FORD names these parts on their page
    up = "../" * (len(page.relative_to(site).parts) - 1)
    text = re.sub(r'<script type="text/x-mathjax-config">.*?</script>', "", text, flags=re.DOTALL)
    text = re.sub(r"<script[^>]*mathjax[^>]*></script>", "", text, flags=re.IGNORECASE)
    text = re.sub(r'\s+integrity="[^"]*"\s+crossorigin="[^"]*"', "", text)
    for local in LOCAL:
        name = PurePosixPath(local).name
        text = re.sub(rf'"https://[^"]*/{re.escape(name)}"', f'"{up}{local}"', text)
    page.write_text(text)
    return problems


def main() -> int:
    """Build, and print what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "docs")
    out = parser.parse_args().out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    site, known = out / "site", pages()
    links = Links(known)
    problems = run_ford(write_pages(known, links, out), site) + links.problems
    if site.is_dir():
        for local, carried in LOCAL.items():
            (site / local).parent.mkdir(exist_ok=True)
            shutil.copyfile(Path(mkdocs.__file__).parent / carried, site / local)
        for file in links.copied:
            (site / "files" / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / file, site / "files" / file)
        for page in sorted(site.rglob("*.html")):
            problems += finish_page(page, site)
        problems += broken_links(site)
    print("\n".join(problems) or f"{site / 'index.html'}: every link leads somewhere")
    return min(len(problems), 1)


if __name__ == "__main__":
    sys.exit(main())
