"""The form of a case, made of the schema that the program prints: a part for each group, a field
for each variable with its unit, its default and what it means."""

from typing import Any

from micstools.pages.html import Markup, tag
from micstools.serve.draft import Draft, Schema, words_of

_OPEN = 4  # groups of one name that are open at first


def form(draft: Draft) -> Markup:
    """All groups, those of the case with their fields, the others to be added."""
    values = draft.values()
    parts = []
    for group, about in draft.groups.items():
        here = [(n, said) for name, n, said in values if name == group]
        title = tag("h3", f"&{group} ", tag("small", about.get("description", "")))
        add = draft.repeats(group) or not here
        button = tag("button", f"add &{group}", type="button", data_add=group) if add else None
        fields = [_instance(draft, group, n, said, len(here)) for n, said in here]
        parts.append(tag("section", title, *fields, button, class_="group-part", id=f"g-{group}"))
    names = [
        said["name"] for name, _, said in values if name == "shape" and said and "name" in said
    ]
    known = tag("datalist", *(tag("option", value=name) for name in names), id="shapes")
    return tag("form", *parts, known, autocomplete="off", novalidate=True)


def _instance(draft: Draft, group: str, n: int, said: dict[str, str] | None, of: int) -> Markup:
    """One group of the case."""
    about = draft.groups[group]
    if said is None:
        words = "This group cannot be read: mend it in the text."
        return tag("p", words, class_="wrong", data_of=f"{group}.{n}")
    needed = draft.needed(group)
    shown = [name for name in about["properties"] if name in needed or name in said]
    others = [name for name in about["properties"] if name not in shown]
    more = tag(
        "details",
        tag("summary", f"{len(others)} more"),
        *(_field(draft, group, n, name, said) for name in others),
        class_="more",
    )
    tools = tag(
        "span",
        tag("button", "copy", type="button", data_copy=group, data_n=n)
        if draft.repeats(group)
        else None,
        tag("button", "remove", type="button", data_remove=group, data_n=n),
        class_="tools",
    )
    fields = [_field(draft, group, n, name, said) for name in shown]
    number = f" {n + 1}" if draft.repeats(group) else ""
    names = ("title", "name", "kind", "shape", "file", "position")
    brief = " · ".join(said[name] for name in names if said.get(name))[:60]
    summary = tag("summary", tag("b", f"&{group}{number}"), " ", tag("span", brief), tools)
    opened = of <= _OPEN or None
    return tag("details", summary, tag("p", class_="wrong", data_of=f"{group}.{n}"), *fields,
               more if others else None, class_="instance", open=opened)  # fmt: skip


def _field(draft: Draft, group: str, n: int, name: str, said: dict[str, str]) -> Markup:
    about, value = draft.variable(group, name), said.get(name, "")
    key = f"{group}-{n}-{name}"
    unit = about.get("unit", "")
    label = tag("span", name, tag("small", f" [{unit}]") if unit not in ("", "-") else None)
    needed = name in draft.needed(group)
    told = tag("small", class_="wrong", id=f"{key}-wrong", role="alert")
    default = words_of(about.get("default"))
    more = "; must be given" if needed else f"; default {default}" if default else ""
    hint = tag("small", f"{about.get('description', '')}{more}", class_="hint-of")
    ours = {"data_group": group, "data_n": n, "data_variable": name, "aria_describedby":
            f"{key}-wrong", "id": key}  # fmt: skip
    return tag("label", label, _control(about, value, needed, name, ours), told, hint,
               class_="field")  # fmt: skip


def _control(about: Schema, value: str, needed: bool, name: str, ours: dict[str, Any]) -> Markup:
    choices = about.get("enum")
    if about.get("type") == "boolean":
        choices = [".true.", ".false."]
    if choices is None:
        default = about.get("default", (about.get("examples") or [""])[0])
        shown = words_of(default)
        known = "shapes" if name == "shape" else None
        return tag("input", type="text", value=value, placeholder=shown, list=known,
                   spellcheck="false", **ours)  # fmt: skip
    words = "choose …" if needed else f"default: {words_of(about.get('default')) or 'none'}"
    listed = [*choices, *([value] if value and value not in choices else [])]  # a wrong one stays
    options = [tag("option", words, value="")]
    options += [
        tag("option", option, value=option, selected=True if option == value else None)
        for option in listed
    ]
    return tag("select", *options, **ours)
