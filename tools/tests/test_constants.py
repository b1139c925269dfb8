"""Every threshold and fitted constant of src is explained in docs/constants.md, with its value."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "constants.md"
DECLARED = re.compile(r"^ *real\([ws]p\), parameter(?:, \w+)* :: (.*)$", re.MULTILINE)
ROW = re.compile(r"^\| `([\w/]+\.f90)` `(\w+)` \| `([^`]+)` \|(.*)\|$", re.MULTILINE)
NO_CONSTANTS = {
    "base/kinds.f90": {"pi"},
    # what follows from geometry alone
    "shapes/armour_units.f90": {"cosine", "sine"},
    "shapes/shapes_builtin.f90": {"golden"},
    "shapes/contact_sphere_placement.f90": {"turn"},
    # a ratio of two constants of the page
    "blocks/contact_response.f90": {"share"},
    # marks for "none"
    "shapes/surface_search.f90": {"nowhere"},
    "case/allowed_values.f90": {"boundless"},
    "case/case_types.f90": {"absent"},
    "liquid/extended_fraction.f90": {"unknown"},
    "liquid/liquid_fill.f90": {"no_surface"},
    "grid/outflow.f90": {"elsewhere"},
    "coupling/voxels.f90": {"no_hit"},
    "momentum/surface_heights.f90": {"no_height"},
}


def declared(text: str) -> dict[str, str]:
    """Single real constants of a source with their values, without the kind of the literals."""
    text = re.sub(r"&[ \t]*(?:!.*)?\n\s*", "", text)
    found = {}
    for line in DECLARED.findall(text):
        names = re.split(r",\s*(?=\w+(?:\([^)]*\))?\s*=[^=])", line.split("!")[0])
        for name, value in (each.split("=", 1) for each in names):
            if "(" not in name:
                found[name.strip()] = re.sub(r"_[ws]p\b", "", value).strip()
    return found


def constants(source: Path) -> dict[tuple[str, str], str]:
    """All that the page has to explain."""
    found = {}
    for path in sorted(source.rglob("*.f90")):
        file = str(path.relative_to(source))
        for name, value in declared(path.read_text()).items():
            if name not in NO_CONSTANTS.get(file, set()):
                found[file, name] = value
    return found


def explained(page: str) -> dict[tuple[str, str], str]:
    """Constants of the page with their values."""
    return {(file, name): value for file, name, value, _ in ROW.findall(page)}


def test_every_constant_is_on_the_page() -> None:
    found, told = constants(ROOT / "src"), explained(PAGE.read_text())
    assert sorted(found.keys() - told.keys()) == [], "missing on the page"
    assert sorted(told.keys() - found.keys()) == [], "no longer in src"
    other = {key: (told[key], found[key]) for key in found if told[key] != found[key]}
    assert other == {}, "page and src differ"


def test_every_row_is_complete() -> None:
    """No cell is empty, and what is no constant is still there."""
    for file, name, _, rest in ROW.findall(PAGE.read_text()):
        assert all(cell.strip() for cell in rest.split("|")), f"{file} {name}"
    for file, names in NO_CONSTANTS.items():
        assert names <= declared((ROOT / "src" / file).read_text()).keys(), file


def test_constants_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.f90").write_text(
        "  real(wp), parameter :: one = 1.0_wp/3.0_wp, two = max(1.0_wp, 2.0_wp)   !! three = 3\n"
        "  real(wp), parameter, public :: four = &   ! of\n    4.0e-2_wp\n"
        "  real(wp), parameter :: table(2) = [1.0_wp, 2.0_wp]\n"
        "  integer, parameter :: five = 5\n    real(sp), parameter :: six = 6.0_sp\n"
    )
    assert constants(tmp_path) == {
        ("a.f90", "one"): "1.0/3.0",
        ("a.f90", "two"): "max(1.0, 2.0)",
        ("a.f90", "four"): "4.0e-2",
        ("a.f90", "six"): "6.0",
    }
