"""A pile seen from the front, the side and the top, in parallel and to one scale, as an engineer
draws it. No OpenGL is needed."""

import base64
import io
from dataclasses import dataclass
from itertools import product

import numpy as np
from PIL import Image

from micstools.pages.charts import colour
from micstools.pages.html import Markup, tag
from micstools.pictures.labels import round_below
from micstools.piles.maps import under
from micstools.reading.overlap import Placed
from micstools.reading.reader import Run
from micstools.reading.units import Unit
from micstools.shapes.geometry import Array, IntArray

# What runs to the right, what runs up, what comes towards the viewer; as the pictures of `scene`.
VIEWS = {
    "front": (np.array([1, 0, 0]), np.array([0, 0, 1]), np.array([0, -1, 0])),
    "side": (np.array([0, 1, 0]), np.array([0, 0, 1]), np.array([1, 0, 0])),
    "top": (np.array([1, 0, 0]), np.array([0, 1, 0]), np.array([0, 0, 1])),
    "left": (np.array([0.8, -0.6, 0]), np.array([0.3, 0.4, 0.75**0.5]),
             np.array([-0.75**0.5 * 0.6, -0.75**0.5 * 0.8, 0.5])),
    "right": (np.array([0.8, 0.6, 0]), np.array([-0.3, 0.4, 0.75**0.5]),
              np.array([0.75**0.5 * 0.6, -0.75**0.5 * 0.8, 0.5])),
}  # fmt: skip
NAMES = {"front": ("x", "z"), "side": ("y", "z"), "top": ("x", "y")}
_LIGHT = np.array([-0.35, 0.55, 0.76])  # from the viewer's upper left
FIXED = "#8d8d8d"
BED = "#b7a78c"
_MANY = 20  # blocks: more have smaller numbers
_LINED = 300  # pixels that a block must show on average to have lines


@dataclass(frozen=True)
class Seen:
    """What is seen of the blocks on squares of `step` [m], the first row at the bottom."""

    block: IntArray  # (rows, columns) number of the block, from 1; 0: none
    light: Array  # (rows, columns) 0 dark to 1
    depth: Array  # (rows, columns) towards the viewer [m]
    low: Array  # (2) corner [m]
    step: float


def look(surfaces: dict[int, Array], view: str, low: Array, high: Array, step: float) -> Seen:
    """What is seen of surfaces, triangles (m, 3, 3) by the number of their block from 0, in the
    box from `low` to `high` (3)."""
    axes = np.array(VIEWS[view], float)
    corners = np.array(list(product(*zip(low, high, strict=True)))) @ axes.T
    corner, far = corners.min(axis=0), corners.max(axis=0)
    n = np.maximum(1, np.ceil((far[:2] - corner[:2]) / step - 1e-9).astype(int))
    depth = np.full((n[1], n[0]), -np.inf)
    block, light = np.zeros(depth.shape, dtype=np.int64), np.zeros(depth.shape)
    if surfaces:
        triangles = np.concatenate(list(surfaces.values())) @ axes.T
        number = np.repeat(np.array(list(surfaces)) + 1, [len(s) for s in surfaces.values()])
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals *= np.sign(normals[:, 2:])  # an open surface is seen from behind, too
        square, height, above = under(triangles, corner, step, depth.shape)
        order = np.lexsort((-above, height, square))
        top = order[np.append(np.diff(square[order]) > 0, True)] if len(order) else order
        seen, which = square[top], above[top]
        depth.flat[seen], block.flat[seen] = height[top], number[which]
        towards = _LIGHT / np.linalg.norm(_LIGHT)
        shade = normals[which] @ towards / np.linalg.norm(normals[which], axis=1)
        light.flat[seen] = 0.5 + 0.5 * np.maximum(0.0, shade)
    return Seen(block, light, depth, corner[:2], step)


def surfaces_of(bodies: dict[int, Placed]) -> dict[int, Array]:
    """Triangles (m, 3, 3) of each block."""
    return {k: body.triangles for k, body in bodies.items()}


def ground(bed: Array, view: str, low: Array, high: Array, step: float) -> Image.Image:
    """The bed, triangles (m, 3, 3): from the top as it is, from a side its highest outline."""
    seen = look({0: bed}, "top", low, high, step)
    if view != "top":
        outline = seen.depth.max(axis=0 if view == "front" else 1)
        rows = max(1, int(np.ceil((high[2] - low[2]) / step - 1e-9)))
        middle = low[2] + (np.arange(rows)[:, None] + 0.5) * step
        filled = (middle < outline).astype(np.int64)
        corner = np.array([low[0 if view == "front" else 1], low[2]])
        seen = Seen(filled, 0.95 * filled, np.zeros(filled.shape), corner, step)
    return paint(seen, {1: BED}, edges=False)


def paint(seen: Seen, colours: dict[int, str], edges: bool = True) -> Image.Image:
    """The picture: colours by the number of the block from 1, edges dark unless blocks are so small
    that lines would hide them, nothing elsewhere."""
    colour = np.zeros((int(seen.block.max(initial=0)) + 1, 4))
    covered = seen.block[seen.block > 0]
    shown = np.unique(covered)
    for number in shown:
        rgb = np.array([int(colours[int(number)][k : k + 2], 16) for k in (1, 3, 5)])
        colour[number] = [*(255 - (255 - rgb) * 0.92), 255]
    pixels = colour[seen.block]
    pixels[..., :3] *= seen.light[..., None]
    if edges and covered.size >= _LINED * len(shown):
        # Where one block ends before another or a face bends
        found = np.zeros(seen.block.shape, dtype=bool)
        for axis in (0, 1):
            other = np.diff(seen.block, axis=axis) != 0
            bend = np.abs(np.diff(seen.light, axis=axis)) > 0.02
            with np.errstate(invalid="ignore"):
                jump = np.abs(np.diff(seen.depth, axis=axis)) > 12 * seen.step
            line = other | bend | jump
            first, second = [slice(None)] * 2, [slice(None)] * 2
            first[axis], second[axis] = slice(None, -1), slice(1, None)
            found[tuple(first)] |= line & (seen.block[tuple(first)] > 0)
            found[tuple(second)] |= other & (seen.block[tuple(first)] == 0)
        pixels[np.asarray(found & (seen.block > 0))] = (28, 32, 38, 255)
    flipped = np.round(pixels[::-1]).clip(0, 255).astype(np.uint8)
    return Image.fromarray(flipped, "RGBA")


def uri(picture: Image.Image, colours: int = 96) -> str:
    """A picture as an address that holds it, with few colours to keep it small."""
    file = io.BytesIO()
    clear = picture.mode == "RGBA"
    method = Image.Quantize.FASTOCTREE if clear else Image.Quantize.MEDIANCUT
    picture.quantize(colours, method).save(file, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


def block_colours(dropped: IntArray, n: int) -> dict[int, str]:
    """Colour of each of `n` blocks, by its number from 1: grey where it is fixed, else by its
    turn."""
    order = {int(k): place for place, k in enumerate(dropped)}
    return {k + 1: colour(order[k]) if k in order else FIXED for k in range(n)}


def bed_of(run: Run) -> Array:
    """Triangles (m, 3, 3) of the bed; none without one."""
    points, triangles = run.bed
    return np.asarray(points[triangles]) if len(triangles) else np.empty((0, 3, 3))


@dataclass(frozen=True)
class Sheet:
    """The views of one pile: one scale for all of them."""

    low: Array  # corner of what is shown (3) [m]
    high: Array
    bed: Array  # triangles (m, 3, 3) [m]
    pixels: float = 900.0  # of the longest side

    @property
    def step(self) -> float:
        """A pixel [m]."""
        return float((self.high - self.low).max()) / self.pixels

    def picture(
        self, bodies: dict[int, Placed], colours: dict[int, str], view: str
    ) -> tuple[Image.Image, Seen]:
        """One view without words, and what is seen in it."""
        seen = look(surfaces_of(bodies), view, self.low, self.high, self.step)
        picture = paint(seen, colours)
        if len(self.bed):
            below = ground(self.bed, view, self.low, self.high, self.step)
            picture = Image.alpha_composite(below, picture)
        return picture, seen

    def corner(self, bodies: dict[int, Placed], colours: dict[int, str]) -> Markup:
        """Blocks and bed, or the floor, from above the front corner that the bed falls to: the
        picture of a page on paper, where nothing turns."""
        (x0, y0, z), (x1, y1, _) = self.low, self.high
        floor = np.array([[[x0, y0, z], [x1, y0, z], [x1, y1, z]],
                          [[x0, y0, z], [x1, y1, z], [x0, y1, z]]])  # fmt: skip
        ground = self.bed if len(self.bed) else floor
        middle, step = ground.mean(axis=1), 1.2 * self.step
        falls = ((middle[:, 0] - middle[:, 0].mean()) * (middle[:, 2] - z)).sum() < 0
        view = "right" if falls else "left"
        seen = look(surfaces_of(bodies), view, self.low, self.high, step)
        below = look({0: ground}, view, self.low, self.high, step)
        seen.block[below.depth > seen.depth] = 0
        picture = Image.alpha_composite(paint(below, {1: BED}, edges=False), paint(seen, colours))
        image = tag("img", src=uri(picture.crop(picture.getbbox())), alt="the pile from a corner")
        return tag("figure", image, class_="sheet paper")

    def drawing(self, bodies: dict[int, Placed], colours: dict[int, str], view: str,
                unit: Unit, level: float | None = None) -> Markup:  # fmt: skip
        """One view with the numbers of the blocks, the tank, the water level and a length in a
        unit."""
        picture, seen = self.picture(bodies, colours, view)
        rows, columns = seen.block.shape
        image = tag("image", href=uri(picture), width=columns, height=rows)
        drawn = [image, tag("rect", class_="tank", x=0, y=0, width=columns, height=rows)]
        if level is not None and view != "top":
            at = f"{rows - (level - seen.low[1]) / self.step:.1f}"
            drawn.append(tag("line", class_="level", x1=0, x2=columns, y1=at, y2=at))
        drawn += _numbers(seen)
        drawn += self._bar(rows, unit)
        across, up = NAMES[view]
        margin = 8
        box = f"{-margin} {-margin} {columns + 2 * margin} {rows + 2 * margin + 46}"
        svg = tag("svg", *drawn, viewBox=box, role="img",
                  aria_label=f"the pile from the {view}")  # fmt: skip
        size = f"--share:{(columns + 2 * margin) / (self.pixels + 2 * margin):.4f}"
        words = f"{view}: {across} to the right, {up} up"
        return tag("figure", svg, tag("figcaption", words), class_="view", style=size)

    def _bar(self, rows: int, unit: Unit) -> list[Markup]:
        """A bar of a round length under a view."""
        length = round_below(0.3 * float((self.high - self.low)[:2].min()))
        long, y = length / self.step, rows + 22
        text = unit.text(length)
        return [
            tag("path", class_="scale", d=f"M0 {y - 7}V{y + 7}M0 {y}H{long:.1f}M{long:.1f} "
                f"{y - 7}V{y + 7}"),
            tag("text", text, x=f"{long + 12:.1f}", y=y + 9, class_="large"),
        ]  # fmt: skip


def _numbers(seen: Seen) -> list[Markup]:
    """The number of each block where it is seen, those of which most is seen first; none where too
    little of it is, or where it would meet another."""
    found, places = [], np.empty((0, 2))
    numbers, counts = np.unique(seen.block[seen.block > 0], return_counts=True)
    kind, size = ("number", 30) if len(numbers) <= _MANY else ("number many", 24)
    for number in numbers[np.argsort(-counts, kind="stable")][: np.sum(counts >= 500)]:
        y, x = np.nonzero(seen.block == number)
        nearest = int(((x - x.mean()) ** 2 + (y - y.mean()) ** 2).argmin())
        place = np.array([x[nearest], y[nearest]])
        if (np.abs(places - place) < [1.3 * size, 0.8 * size]).all(axis=1).any():
            continue
        places = np.vstack([places, place])
        found.append(tag("text", number, x=place[0], y=seen.block.shape[0] - place[1] + 10,
                         class_=kind, text_anchor="middle"))  # fmt: skip
    return found
