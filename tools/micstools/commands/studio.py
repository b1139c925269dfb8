"""Edit a case on a page of this machine, run it and watch the run."""

import argparse

from micstools import extras
from micstools.cases import program


def work(given: argparse.Namespace) -> int:
    path = program.find(given.program, given.case)
    extras.need("serve")
    from micstools.serve import server, studio

    server.serve(studio.site_of(given.case, path), given.port, given.browser)
    return 0
