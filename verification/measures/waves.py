"""Standing waves: their amplitude in a run, and exact solutions for small ones."""

import numpy as np
from numpy.typing import NDArray

from micstools.reading.reader import Run
from micstools.shapes.geometry import Array


def standing_amplitude(run: Run, mode: int = 1) -> tuple[Array, Array]:
    """Times [s] and amplitudes [m] of cos(mode pi x/L) in the surface of a plane run (x, z)."""
    low, high = run.grid.low[0], run.grid.high[0]
    n = round((high - low) / run.grid.spacing[0])
    x = (np.arange(n) + 0.5) / n
    shape = np.cos(mode * np.pi * x)
    found = []
    for t in run.field_times:
        heights = run.fields_at(t).liquid[:, 0, :].astype(float).sum(axis=0) * run.grid.spacing[2]
        found.append(2.0 * float(np.mean(heights * shape)))
    # A mean over cells of a cosine that is itself a mean over cells.
    phase = 0.5 * mode * np.pi / n
    return np.array(run.field_times), np.array(found) / (np.sin(phase) / phase)


def period(time: Array, amplitude: Array) -> float:
    """Mean period from the zero crossings of a standing wave, each found by a straight line."""
    before = np.flatnonzero(np.sign(amplitude[:-1]) != np.sign(amplitude[1:]))
    part = amplitude[before] / (amplitude[before] - amplitude[before + 1])
    crossings = time[before] + part * (time[before + 1] - time[before])
    return float(2.0 * np.polyfit(np.arange(len(crossings)), crossings, 1)[0])


def prosperetti_two_fluids(
    time: Array, wavenumber: float, omega: float, viscosity: float, densities: tuple[float, float]
) -> Array:
    """Amplitude over the initial one of a small wave between two deep fluids of one kinematic
    viscosity [m2/s], from rest; omega [1/s] is the frequency without viscosity.

    A. Prosperetti (1981), Motion of two superposed viscous fluids, Phys. Fluids 24, 1217.
    """
    beta = densities[0] * densities[1] / (densities[0] + densities[1]) ** 2
    rate = viscosity * wavenumber**2
    roots = np.roots([
        1.0, -4.0 * beta * rate**0.5, 2.0 * (1.0 - 6.0 * beta) * rate,
        4.0 * (1.0 - 3.0 * beta) * rate**1.5, (1.0 - 4.0 * beta) * rate**2 + omega**2,
    ])  # fmt: skip
    root_t = np.sqrt(time)
    steady = 4.0 * (1.0 - 4.0 * beta) * rate**2 / (8.0 * (1.0 - 4.0 * beta) * rate**2 + omega**2)
    total = steady * np.exp(-rate * time) * _faddeeva(1j * np.sqrt(rate) * root_t)
    for i, z in enumerate(roots):
        others = np.prod([other - z for j, other in enumerate(roots) if j != i])
        decay = np.exp(-rate * time) * _faddeeva(1j * z * root_t)
        total = total + z / others * omega**2 / (z**2 - rate) * decay
    return np.asarray(total.real)


def _faddeeva(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """w(z) = exp(-z^2) erfc(-i z), to about 1e-12.

    J. A. C. Weideman (1994), Computation of the complex error function, SIAM J. Numer. Anal. 31;
    below the real axis by w(z) = 2 exp(-z^2) - w(-z).
    """
    terms = 64
    scale = (terms / 2**0.5) ** 0.5
    theta = np.arange(-2 * terms + 1, 2 * terms) * np.pi / (2 * terms)
    t = scale * np.tan(0.5 * theta)
    values = np.concatenate([[0.0], np.exp(-(t**2)) * (scale**2 + t**2)])
    weights = np.fft.fft(np.fft.fftshift(values)).real / (4 * terms)
    z = np.asarray(z, complex)
    above = np.where(z.imag >= 0.0, z, -z)
    ratio = (scale + 1j * above) / (scale - 1j * above)
    series = np.polyval(weights[terms:0:-1], ratio)
    found = 2.0 * series / (scale - 1j * above) ** 2 + np.pi**-0.5 / (scale - 1j * above)
    with np.errstate(over="ignore"):
        mirrored = 2.0 * np.exp(-(z**2)) - found
    return np.asarray(np.where(z.imag >= 0.0, found, mirrored))
