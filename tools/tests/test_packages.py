"""Which file may use which: the packages of src stand in layers, without circles."""

from pathlib import Path

import packages

ROOT = Path(__file__).parents[2]


def write(folder: Path, **uses: str) -> Path:
    """Sources whose names say where they are, as `base__kinds`, with the modules they use."""
    for name, used in uses.items():
        file = folder / (name.replace("__", "/") + ".f90")
        file.parent.mkdir(parents=True, exist_ok=True)
        lines = [f"  use {other}, only: x" for other in used.split()]
        file.write_text("\n".join(["!> use of it", f"module {file.stem}_m", *lines, "end"]))
    return folder


def test_the_sources_keep_the_order_of_the_packages() -> None:
    found = packages.imports(ROOT / "src")
    assert packages.faults(found) == []
    assert packages.arrows(found)["coupling", "momentum"] > 0


def test_uses_are_found_and_counted(tmp_path: Path) -> None:
    source = write(tmp_path, base__kinds="", grid__grid="kinds_m hdf5", step="kinds_m grid_m")
    found = packages.imports(source)
    assert found["step.f90"] == {"base/kinds.f90", "grid/grid.f90"}
    assert found["grid/grid.f90"] == {"base/kinds.f90"}
    assert packages.arrows(found) == {("top", "base"): 1, ("top", "grid"): 1, ("grid", "base"): 1}
    assert packages.faults(found) == []


def test_a_use_upward_is_named(tmp_path: Path) -> None:
    source = write(tmp_path, base__sums="grid_m", grid__grid="")
    assert packages.faults(packages.imports(source)) == [
        "base/sums.f90 uses grid/grid.f90: grid is not below base"
    ]


def test_a_use_of_a_package_of_the_same_layer_is_named(tmp_path: Path) -> None:
    source = write(tmp_path, liquid__plic="pressure_m", pressure__pressure="")
    (line,) = packages.faults(packages.imports(source))
    assert line.endswith("pressure is not below liquid")


def test_a_submodule_uses_its_module(tmp_path: Path) -> None:
    source = write(tmp_path, base__kinds="", grid__layer="")
    (source / "base" / "part.f90").write_text("submodule (layer_m) part_m\nend submodule part_m\n")
    (line,) = packages.faults(packages.imports(source))
    assert line == "base/part.f90 uses grid/layer.f90: grid is not below base"


def test_a_circle_is_named(tmp_path: Path) -> None:
    source = write(tmp_path, base__a="b_m", base__b="c_m", base__c="a_m")
    (line,) = packages.faults(packages.imports(source))
    assert line.startswith("a circle: base/") and line.count(" uses ") == 3
    assert "base/a.f90 uses base/b.f90" in line or line.endswith("uses base/a.f90")


def test_a_package_without_a_layer_is_named(tmp_path: Path) -> None:
    source = write(tmp_path, waves__maker="")
    assert packages.faults(packages.imports(source)) == ["waves: no such package in packages.toml"]


def test_the_picture_shows_every_package() -> None:
    words = " ".join(
        text.get_text() for text in packages.picture(packages.imports(ROOT / "src")).axes[0].texts
    )
    for package in packages.HEIGHT:
        assert f"{package} (" in words
