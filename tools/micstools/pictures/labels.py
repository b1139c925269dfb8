"""What is written on a picture: time, arrow and length above it, numbers on the blocks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Ids = NDArray[np.int64]
INK = "black"


@dataclass(frozen=True)
class Key:
    """A mark of known length and what it stands for."""

    kind: str  # 'arrow' or 'bar'
    length: int  # [pixels]
    text: str


def letter_size(width: int) -> int:
    """Height of letters in a picture so wide that they can be read on a sheet, too [pixels]."""
    return max(11, round(width / 35))


def round_below(value: float) -> float:
    """The largest of 1, 2, 5, 10, ... times a power of ten that is not above `value` > 0."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(
        max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
    )


def with_header(picture: Image.Image, text: str, keys: list[Key]) -> Image.Image:
    """The picture below a text and the keys, in as many lines as they need."""
    size = letter_size(picture.width)
    places, lines = _arrange(picture.width, text, keys)
    top = round((lines + 0.3) * 1.4 * size)
    whole = Image.new("RGB", (picture.width, picture.height + top), "white")
    whole.paste(picture, (0, top))
    draw = ImageDraw.Draw(whole)
    items: list[str | Key] = [text, *keys]
    for item, (x, line) in zip(items, places, strict=True):
        middle = round((line + 0.75) * 1.4 * size)
        if isinstance(item, Key):
            _draw_key(draw, item, x, middle, size)
            x += item.length + size // 2
        said = item.text if isinstance(item, Key) else item
        draw.text((x, middle), said, INK, _font(size), anchor="lm")
    return whole


def _arrange(width: int, text: str, keys: list[Key]) -> tuple[list[tuple[int, int]], int]:
    """Left end [pixels] and line of the text and each key, and the number of lines."""
    size = letter_size(width)
    font, margin = _font(size), size // 2
    places, x, line = [], margin, 0
    items: list[str | Key] = [text, *keys]
    for item in items:
        if isinstance(item, Key):
            long = item.length + size // 2 + font.getlength(item.text)
        else:
            long = font.getlength(item)
        if x > margin and x + long > width - margin:
            x, line = margin, line + 1
        places.append((x, line))
        x += round(long) + 2 * size
    return places, line + 1


def _draw_key(draw: ImageDraw.ImageDraw, key: Key, x: int, y: int, size: int) -> None:
    thick, end = max(1, size // 9), x + key.length
    draw.line([(x, y), (end, y)], INK, thick)
    tick = size // 3
    if key.kind == "bar":
        for side in (x, end):
            draw.line([(side, y - tick), (side, y + tick)], INK, thick)
    else:
        back = end - min(size // 2, key.length)
        draw.polygon([(end, y), (back, y - tick // 2), (back, y + tick // 2)], INK)


def number_blocks(picture: Image.Image, ids: Ids) -> None:
    """Write on each block its number where it is seen; `ids` (height, width) is 0 elsewhere. What
    is seen only in part too small for the number has none."""
    size = letter_size(picture.width)
    draw, font = ImageDraw.Draw(picture), _font(size)
    for number in np.unique(ids[ids > 0]):
        y, x = np.nonzero(ids == number)
        if len(x) < 1.5 * size * font.getlength(str(number)):
            continue
        nearest = int(((x - x.mean()) ** 2 + (y - y.mean()) ** 2).argmin())
        place = (int(x[nearest]), int(y[nearest]))
        halo = max(1, size // 8)
        draw.text(
            place, str(number), INK, font, anchor="mm", stroke_width=halo, stroke_fill="white"
        )


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
