"""The case file as the program describes it, `mics --help=json`."""

import json
from functools import cache
from importlib.resources import files
from typing import Any


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
