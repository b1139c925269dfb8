"""Parts that the pages share."""

from micstools.pages.html import Markup, markup, tag

_COLOURINGS = (("block", "block"), ("speed", "speed"), ("contacts", "contacts"))
_VIEWS = ("corner", "front", "side", "top")
_WATERS = (("clear", "clear"), ("speed", "by speed"), ("none", "none"))
_HINT = (
    "Front, side and top are to scale: drag to measure, with Shift to move. In the corner view "
    "drag to turn. Bed and walls are see-through before a block."
)


NORTH_IS_Y = "North is taken as the y direction; mics-tools report --north gives another."


def north_note(north: float | None) -> Markup | None:
    """What is assumed of north where nobody has given it."""
    return tag("p", NORTH_IS_Y, class_="note no-print") if north is None else None


def player(name: str, label: str, plan: bool = False, hint: str = "") -> Markup:
    """A stage and its buttons; `name` is that of the element. `plan`: of a set-up, in which nothing
    has moved yet, but the cells are shown; `hint`: what the mouse does, where that is other than
    usual."""
    moving = tag(
        "div",
        tag("button", "Play", class_="play", type="button"),
        tag("input", class_="slider", type="range", min=0, max=1, value=0, aria_label="time"),
        tag("output", "0.00 s", class_="clock"),
        tag("label", "pace", _select("pace", (("0.5", "1/2"),), "0.5")),
        class_="row moving",
    )
    views = tag("span", *(
        tag("button", view, type="button", data_view=view) for view in _VIEWS
    ), class_="group", role="group", aria_label="point of view")  # fmt: skip
    zoom = tag(
        "span",
        tag("button", "+", type="button", data_zoom=0.8, aria_label="nearer"),
        tag("button", "−", type="button", data_zoom=1.25, aria_label="farther"),
        class_="group",
    )
    numbers = tag("input", type="checkbox", class_="numbers", checked=True)
    paths = tag("input", type="checkbox", class_="paths")
    settings = tag(
        "div",
        views,
        zoom,
        tag("label", "colour by", _select("colouring", _COLOURINGS, "block"), hidden=plan or None),
        tag("label", "follow", _select("follow", (("", "whole tank"),), ""), class_="moving",
            hidden=plan or None),
        tag("label", "water", _select("wet", _WATERS, "clear")),
        tag("label", numbers, "numbers"),
        tag("label", paths, "path", class_="moving", hidden=plan or None),
        tag("label", tag("input", type="checkbox", class_="cells", checked=True), "cells")
        if plan
        else None,
        class_="row",
    )  # fmt: skip
    canvas = tag("canvas", class_="stage", tabindex=0, role="img", aria_label=label)
    picture = tag("div", canvas, tag("canvas", class_="over"), class_="picture")
    legend, hint = tag("ul", class_="legend"), tag("p", hint or _HINT, class_="hint")
    sorry = tag("p", "This browser has no WebGL: the pictures below stand for it.", class_="sorry")
    parts = (picture, moving, settings, legend, hint, sorry)
    return tag("div", *parts, class_="player", id=name)


def _select(name: str, options: tuple[tuple[str, str], ...], chosen: str) -> Markup:
    entries = [
        tag("option", words, value=value, selected=True if value == chosen else None)
        for value, words in options
    ]
    return tag("select", *entries, class_=name)


def swatch(colour: str, words: object) -> Markup:
    """Words after a square of a colour."""
    return markup(tag("i", class_="swatch", style=f"background:{colour}"), words)


def number(value: float, form: str = ".3g", unit: str = "") -> str:
    """A figure with its unit, a dash where it is not known."""
    if value != value:
        return "–"
    return f"{value:{form}}" + (f" {unit}" if unit else "")
