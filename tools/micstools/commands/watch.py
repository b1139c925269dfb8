"""Watch a run or an ensemble on a page of this machine."""

import argparse

from micstools import command, extras


def work(given: argparse.Namespace) -> int:
    folder = command.output_of(given.run)
    extras.need("serve")
    from micstools.serve import server, watch

    server.serve(watch.site_of(folder), given.port, given.browser)
    return 0
