"""A torque-free box keeps angular momentum and energy."""

import numpy as np

from measures.checks import Checks
from micstools.reading.reader import Run
from micstools.shapes.geometry import rotation_matrix

MOMENTUM_BAND = 1e-12
ENERGY_BAND = 1e-4


def check(runs: list[Run], checks: Checks) -> None:
    """Angular momentum and energy at every row, from attitude, angular velocity and inertia."""
    for run in runs:
        b = run.bodies
        turn, omega = rotation_matrix(b.quaternion[:, 0]), b.angular_velocity[:, 0]
        inertia = turn @ run.shapes["box"].inertia @ np.swapaxes(turn, 1, 2)
        momentum = np.einsum("tij,tj->ti", inertia, omega)
        size = np.linalg.norm(momentum, axis=1)
        energy = 0.5 * np.einsum("ti,ti->t", omega, momentum)
        turned = np.degrees(np.arccos(np.abs(b.quaternion[:, 0] @ b.quaternion[0, 0]).min()))
        checks.true("it turns over", turned > 45.0, f"{2 * turned:.0f} degrees")
        drift = np.abs(size / size[0] - 1.0).max()
        checks.below("size of the angular momentum", drift, MOMENTUM_BAND)
        drift = np.linalg.norm(momentum - momentum[0], axis=1).max() / size[0]
        checks.below("its direction too", drift, MOMENTUM_BAND)
        checks.below("energy", np.abs(energy / energy[0] - 1.0).max(), ENERGY_BAND)
        moved = np.linalg.norm(b.position[:, 0] - b.position[0, 0], axis=1).max()
        checks.below("way of the centroid [m]", moved, 1e-15)
        checks.figure("energy", "t [s]", "E/E0 - 1", {"mics": (b.time, energy / energy[0] - 1.0)})
