"""The packages of the sources and which uses which, as in docs/architecture.md.

usage: python tools/draw_packages.py [--out FILE]
"""

import argparse
from pathlib import Path

import packages

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Print what is against the order, then draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs/figures/packages.png")
    given = parser.parse_args()
    found = packages.imports(ROOT / "src")
    for line in packages.faults(found):
        print(line)
    packages.picture(found).savefig(given.out, dpi=120)
    print(given.out)


if __name__ == "__main__":
    main()
