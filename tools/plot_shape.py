"""A block as polygons, tetrahedra and contact spheres, like the paper's figure 1.

usage: python tools/plot_shape.py hexapod|cube|RUN [--shape NAME] [--out FILE]
"""

from micstools.cli import script

if __name__ == "__main__":
    script("plot_shape", __doc__)
