"""Reads namelists by f90nml, within what the program takes of them."""

import re

import f90nml

_ASIDE = re.compile(r"'[^'\n]*'|\"[^\"\n]*\"|![^\n]*")
_COUNT = re.compile(r"(\d+)\s*\*")
_INDEX = re.compile(r"\w\s*\([^)]*\)\s*=")
_MOST = 1000  # values of one variable, as the program takes them


def read(text: str) -> f90nml.Namelist:
    """Every group of a text with its variables. Raises ValueError where it is no namelist that the
    program takes."""
    plain = _ASIDE.sub("", text)
    for count in _COUNT.findall(plain):
        if not 1 <= float(count) <= _MOST:
            raise ValueError(f"a repeat count must be 1 to {_MOST}")
    if _INDEX.search(plain):
        raise ValueError("variables have no index")
    try:
        return f90nml.Parser().reads(text + "\n")  # else it prints its table of characters
    except Exception as error:  # f90nml raises what Python has for a text it cannot follow
        raise ValueError(type(error).__name__) from error
