"""Units by the size of the blocks, and figures that anyone reads."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from micstools.reading import units


@pytest.mark.parametrize(
    ("value", "words"),
    [(6.789, "6.79"), (0.4, "0.4"), (6790.0, "6790"), (1.0132e6, "1.01e+06"), (123456.0, "123000"),
     (0.0, "0"), (-0.01234, "-0.0123"), (3.2e-7, "3.2e-07"), (999.7, "1000"), (float("nan"), "–")],
)  # fmt: skip
def test_figures_have_three_digits(value: float, words: str) -> None:
    assert units.figure(value) == words


class Plain:
    """Units with their texts in plain blanks."""

    def __init__(self, of: units.Units) -> None:
        self.of = of

    def __getattr__(self, kind: str) -> Any:
        unit = self.of.of_kind(kind)
        text = lambda value: unit.text(value).replace("\u00a0", " ")  # noqa: E731
        return SimpleNamespace(text=text, plain=unit.plain)


def test_units_grow_with_the_blocks() -> None:
    laboratory, site = units.of_size(0.06), units.of_size(2.0)
    assert laboratory.length.text(0.0679) == "67.9\u00a0mm"
    laboratory, site = Plain(laboratory), Plain(site)
    assert laboratory.length.text(0.0679) == "67.9 mm" and site.length.text(6.79) == "6.79 m"
    assert laboratory.area.text(0.0123) == "123 cm²" and site.area.text(61.2) == "61.2 m²"
    assert laboratory.volume.text(56e-6) == "56 cm³" and site.volume.text(2.24) == "2.24 m³"
    assert laboratory.mass.text(0.129) == "0.129 kg" and site.mass.text(5376.0) == "5.38 t"
    assert laboratory.force.text(1.264) == "1.26 N" and site.force.text(1.01e6) == "1010 kN"
    assert laboratory.energy.text(0.0757) == "75.7 mJ" and site.energy.text(6790.0) == "6.79 kJ"
    assert laboratory.speed.text(0.512) == site.speed.text(0.512) == "0.512 m/s"
    assert site.area.plain(61.2) == "61.2 m2" and site.area.plain(float("nan")) == "-"


def test_arrays_and_several_figures() -> None:
    site = units.of_size(2.0)
    assert site.force.of(np.array([1e3, 2e3])) == pytest.approx([1.0, 2.0])
    assert site.length.row([26.0, 6.0, 12.8], " x ") == "26 x 6 x 12.8\u00a0m"


def run(lengths: list[float], tank: float = 1.0) -> Any:
    names = [str(k) for k in range(len(lengths))]
    return SimpleNamespace(
        bodies=SimpleNamespace(n=len(names), shape=names),
        shapes={name: SimpleNamespace(length=v) for name, v in zip(names, lengths, strict=True)},
        grid=SimpleNamespace(low=np.zeros(3), high=np.array([tank, 0.1, 0.1])),
    )


def test_the_largest_block_decides_or_the_tank() -> None:
    assert units.of_run(run([0.05, 2.0])).length.name == "m"
    assert units.of_run(run([0.05])).length.name == "mm"
    assert units.of_run(run([], tank=1.0)).length.name == "mm"
    assert units.of_run(run([], tank=100.0)).length.name == "m"
