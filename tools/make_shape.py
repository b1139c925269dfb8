"""A block of kind 'file' from a drawing: checks the surface, fills it with tetrahedra, tells mass.

usage: python tools/make_shape.py FILE.stl|.obj|.step [--size M | --scale X] --out BLOCK.txt

Exit code 2 and a message for a surface that cannot become a block.
"""

from micstools.cli import script

if __name__ == "__main__":
    script("make_shape", __doc__)
