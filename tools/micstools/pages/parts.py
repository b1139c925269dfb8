"""Parts that the pages share."""

from micstools.pages.html import Markup, filled, markup, tag

_HINT = (
    "Front, side and top are to scale: drag to measure, with Shift to move. In the corner view "
    "drag to turn. Bed and walls are see-through before a block."
)
NORTH_IS_Y = "North is taken as the y direction; --north gives another."


def north_note(north: float | None) -> Markup | None:
    """What is assumed of north where nobody has given it."""
    return tag("p", NORTH_IS_Y, class_="note no-print") if north is None else None


def player(name: str, label: str, plan: bool = False, hint: str = "") -> Markup:
    """A stage and its buttons; `name` is that of the element. `plan`: of a set-up, in which nothing
    has moved yet, but the cells are shown; `hint`: what the mouse does, where that is other than
    usual."""
    cells = Markup('<label><input type="checkbox" class="cells" checked> cells</label>')
    return filled("player", name=name, label=label, hint=hint or _HINT, cells=cells if plan else "",
                  hidden="hidden" if plan else "")  # fmt: skip


def swatch(colour: str, words: object) -> Markup:
    """Words after a square of a colour."""
    return markup(tag("i", class_="swatch", style=f"background:{colour}"), words)


def number(value: float, form: str = ".3g", unit: str = "") -> str:
    """A figure with its unit, a dash where it is not known."""
    if value != value:
        return "–"
    return f"{value:{form}}" + (f" {unit}" if unit else "")
