"""The case file as the program describes it, `mics --help=json`."""

import json
from functools import cache
from importlib.resources import files
from typing import Any

_TYPES: dict[str, Any] = {"number": (int, float), "integer": int, "string": str, "boolean": bool}


@cache
def schema() -> dict[str, Any]:
    """Groups, variables, defaults and meanings."""
    text = (files("micstools") / "mics-case.schema.json").read_text("utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def variables(group: str) -> dict[str, dict[str, Any]]:
    """What is known of each variable of a group."""
    found: dict[str, dict[str, Any]] = schema()["$defs"][group]["properties"]
    return found


def require_types(group: str, given: dict[str, Any]) -> None:
    """Raise ValueError where a variable has a value of another type than the program takes."""
    known = schema()["$defs"].get(group, {"properties": {}})["properties"]
    for name, value in given.items():
        about = known.get(name, {})
        about = about.get("items", about)
        values = value if isinstance(value, list) else [value]
        wanted = _TYPES.get(about.get("type", ""), object)
        if not all(isinstance(v, wanted) for v in values):
            raise ValueError(f"&{group} {name} = {value!r} is no {about['type']}")
