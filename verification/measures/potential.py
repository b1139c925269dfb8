"""Added mass in closed containers with slip walls, by potential flow."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.polynomial.legendre import leggauss

Field = Callable[[np.ndarray], np.ndarray]


def sphere_in_cube(diameter: float, edge: float, degree: int = 25) -> float:
    """Added mass over displaced mass of a sphere that moves along z in the middle of a cube.

    The potential is a sum of solid harmonics about the centre with the symmetry of the cube; each
    regular one has the singular one beside it that keeps the normal velocity on the sphere right
    (cos theta for the first degree, 0 else). What is free is fitted to zero normal velocity on the
    walls by least squares.
    """
    a, half = diameter / 2, edge / 2
    points, weights = leggauss(24)
    s, t = np.meshgrid(points, points)
    root = np.sqrt(np.outer(weights, weights)).ravel()
    walls = [  # wall x = half, and the lid z = half; y is like x
        (np.array([np.full(s.size, 1.0), s.ravel(), t.ravel()]) * half, 0),
        (np.array([s.ravel(), t.ravel(), np.full(s.size, 1.0)]) * half, 2),
    ]
    modes = [(n, m) for n in range(1, degree + 1, 2) for m in range(0, n + 1, 4)]
    columns, target = [], []
    for n, m in modes:
        columns.append(np.concatenate([_slope(x, d, n, m, a, half) * root for x, d in walls]))
    for x, d in walls:  # the part of degree one that the moving sphere forces: -a^3/2 z/r^3
        target.append(-_gradient(lambda x: -(a**3) / 2 * x[2] / _norm(x) ** 3, x, d) * root)
    scale = np.array([np.abs(column).max() for column in columns])
    matrix = np.array(columns).T / scale
    free = np.linalg.lstsq(matrix, np.concatenate(target), rcond=None)[0] / scale
    # added mass = -rho int phi cos theta dS; only degree one has a share
    return float(0.5 - 1.5 * free[0] / half)


def circle_in_square(diameter: float, edge: float, degree: int = 41) -> float:
    """The same for a circle that moves in the middle of a square, in two dimensions."""
    a, half = diameter / 2, edge / 2
    points, weights = leggauss(48)
    root = np.sqrt(weights)
    sides = [(np.array([np.full(48, half), points * half]), 0)]
    sides += [(np.array([points * half, np.full(48, half)]), 1)]

    def part(n: int, x: np.ndarray) -> np.ndarray:
        power = (x[0] / half + 1j * x[1] / half) ** n
        r2 = (x**2).sum(axis=0)
        return np.asarray(power.imag * (1 + (a * a / r2) ** n))

    def slopes(function: Field) -> np.ndarray:
        step, found = 1e-6 * half, []
        for x, d in sides:
            ahead, behind = x.copy(), x.copy()
            ahead[d] += step
            behind[d] -= step
            found.append((function(ahead) - function(behind)) / (2 * step) * root)
        return np.concatenate(found)

    columns = np.array([slopes(partial(part, n)) for n in range(1, degree + 1, 2)])
    scale = np.abs(columns).max(axis=1)
    target = -slopes(lambda x: -a * a * x[1] / (x**2).sum(axis=0))
    free = np.linalg.lstsq((columns / scale[:, None]).T, target, rcond=None)[0] / scale
    return float(1 - 2 * free[0] / half)


def _norm(x: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((x**2).sum(axis=0)))


def _gradient(function: Field, x: np.ndarray, axis: int) -> np.ndarray:
    """Derivative along an axis by the complex step."""
    shifted = x.astype(complex)
    shifted[axis] += 1e-30j
    return np.asarray(function(shifted).imag / 1e-30)


def _slope(x: np.ndarray, axis: int, n: int, m: int, a: float, half: float) -> np.ndarray:
    """Normal velocity of a regular harmonic and the singular one that belongs to it; lengths over
    `half`, so that degree one is z/half."""

    def potential(x: np.ndarray) -> np.ndarray:
        r = _norm(x)
        regular = _solid(x / half, n, m)
        return regular * (1 + n / (n + 1) * (a / r) ** (2 * n + 1))

    return _gradient(potential, x, axis)


def _solid(x: np.ndarray, n: int, m: int) -> np.ndarray:
    """Solid harmonic r^n P_n^m(cos theta) cos(m phi), up to a factor, as a polynomial."""
    r2 = (x**2).sum(axis=0)
    # Re (x + i y)^m without complex numbers, which the complex step needs for itself
    real, imag = np.ones_like(x[0]), np.zeros_like(x[0])
    for _ in range(m):
        real, imag = real * x[0] - imag * x[1], real * x[1] + imag * x[0]
    lower, here = np.zeros_like(x[0]), np.ones_like(x[0])
    for k in range(m, n):  # (k - m + 1) P_(k+1) = (2 k + 1) z P_k - (k + m) r^2 P_(k-1)
        lower, here = here, ((2 * k + 1) * x[2] * here - (k + m) * r2 * lower) / (k - m + 1)
    return np.asarray(real * here)
