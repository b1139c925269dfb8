"""Blocks bounce with the restitution asked for, or as their spring and dashpot say."""

import numpy as np

from measures.checks import Checks
from measures.facts import table
from micstools.reading.reader import Run

RESTITUTION_BAND = 0.02
BAND = 0.01
MOMENTUM_BAND = 1e-12
ENERGY_BAND = 1e-3
ON_FLOOR = ("sphere", "cube flat", "cube on an edge", "cube on a corner")
PAIRS = ("two spheres", "face on face", "edge on face", "corner on face", "edge across edge")
OBLIQUE = ("edge on face with ends on its border", "edge along edge", "corner on corner")
"""These touch along several oblique normals; the last pair slips off sideways and turns."""
LENGTH, TIME = 1e-4, 1e-2  # units of the tables D3 [m], [s]
OPTIONS = ("model", "restitution", "contact_time", "friction", "wall_friction", "law")
CONSTANTS = ("k_n", "gamma_n", "eta_n", "k_t", "gamma_t", "eta_t")
VARIES = tuple(f"contact {name}" for name in OPTIONS + CONSTANTS)


def rows(name: str) -> np.ndarray:
    """A reference table."""
    return table(__file__, name).to_numpy()


def restitution(run: Run, checks: Checks) -> None:
    """Ratio of the speeds before and after: on the floor, and of two blocks."""
    b, e = run.bodies, float(run.value("contact", "restitution"))
    low, high = e - RESTITUTION_BAND, e + RESTITUTION_BAND
    if e == 1.0:  # energy 0.99 to 1.01
        low, high = np.sqrt(0.99), np.sqrt(1.01)
    w = b.velocity[:, :, 2]
    oblique = run.folder.name.startswith("oblique")
    floor = () if oblique else ON_FLOOR
    for k, how in enumerate(floor):
        checks.within(f"e = {e:g}, {how} on the floor", -w[-1, k] / w[0, k], low, high)
    for n, how in enumerate(OBLIQUE if oblique else PAIRS):
        i, j = len(floor) + 2 * n, len(floor) + 2 * n + 1
        closing = w[:, i] - w[:, j]
        returned = -closing[-1] / closing[0]
        checks.within(f"e = {e:g}, {how}", returned, low, high, how != "corner on corner")
        total = b.mass[i] * b.velocity[:, i] + b.mass[j] * b.velocity[:, j]
        drift = np.abs(total - total[0]).max() / (b.mass[i] * np.abs(w[0, i]))
        checks.below(f"e = {e:g}, {how}: momentum", drift, MOMENTUM_BAND)
    energy = run.series.kinetic_energy_bodies + run.series.contact_energy
    gain = max(energy.max() / energy[0] - 1.0, 0.0)
    whose = "of oblique contacts" if oblique else "of all"
    checks.below(f"e = {e:g}: gain of energy {whose}", gain, ENERGY_BAND)


def soft_impact(e: float, contact_time: float, v: float) -> tuple[float, float, float]:
    """Depth, speed upwards and duration where an impact under gravity on the spring and dashpot of
    that restitution ends, at zero force: x'' = g - omega^2 x - 2 zeta omega x', in closed form."""
    trials = np.linspace(1e-6, 0.999, 100001)
    zeta = float(np.interp(-e, -np.exp(-trials * duration(trials)), trials))
    omega = float(duration(np.array(zeta))) / contact_time
    swing, rest = omega * np.sqrt(1.0 - zeta**2), 9.81 / omega**2
    t = np.linspace(0.0, 3.0 * contact_time, 300001)[1:]
    sine = (v - zeta * omega * rest) / swing
    fading, c, s = np.exp(-zeta * omega * t), np.cos(swing * t), np.sin(swing * t)
    x, slow = rest + fading * (sine * s - rest * c), zeta * omega
    dx = fading * ((sine * swing + rest * slow) * c + (rest * swing - sine * slow) * s)
    end = int(np.argmax(omega**2 * x + 2.0 * zeta * omega * dx <= 0.0))
    return float(x[end]), float(-dx[end]), float(t[end])


def duration(zeta: np.ndarray) -> np.ndarray:
    """Of an impact that ends at zero force, in units of sqrt(m/k); D2 of the theory."""
    return 2.0 * np.arccos(zeta) / np.sqrt(1.0 - zeta**2)


def ball(run: Run, checks: Checks) -> None:
    """Times of two impacts and the height between, against the same spring and dashpot, and against
    a rigid ball as far as the contact is short."""
    b, e = run.bodies, float(run.value("contact", "restitution"))
    contact_time = float(run.value("contact", "contact_time"))
    t, gap, g = b.time, b.position[:, 0, 2] - 0.02, 9.81
    _, _, first, top, second, _ = next(r for r in rows("D7.csv") if np.allclose(r[:2], (gap[0], e)))
    name = f"ball, h = {gap[0]:g}, e = {e:g}, contact {1e3 * contact_time:g} ms:"
    into = [k for k in range(1, len(t)) if gap[k] <= 0.0 < gap[k - 1]]
    times = [float(np.interp(0.0, [gap[k], gap[k - 1]], [t[k], t[k - 1]])) for k in into[:2]]
    flight = slice(into[0] + int(np.argmax(gap[into[0] :] > 0.0)), into[1])
    rebound = float((gap[flight] + b.velocity[flight, 0, 2] ** 2 / (2.0 * g)).mean())
    depth, speed, takes = soft_impact(e, contact_time, np.sqrt(2.0 * g * gap[0]))
    soft_top = speed**2 / (2.0 * g) - depth
    back = speed / g + np.sqrt(2.0 * soft_top / g)
    rigid = contact_time < 1e-3
    checks.close(f"{name} first impact [s]", times[0], first, BAND)
    checks.close(f"{name} height between, soft ball [m]", rebound, soft_top, BAND)
    checks.close(f"{name} height between, rigid ball [m]", rebound, top, BAND, rigid)
    checks.close(f"{name} second impact, soft ball [s]", times[1], first + takes + back, BAND)
    checks.close(f"{name} second impact, rigid ball [s]", times[1], second, BAND, rigid)
    if rigid:
        at = np.linspace(first, second, 60)
        exact = (at, (at - first) * g / 2 * (second - at))
        checks.figure(name, "t [s]", "clearance [m]", {"mics": (t, gap)}, {"rigid": exact}, True)


def power_law(run: Run, checks: Checks) -> None:
    """Duration, restitution and, without a dashpot, depth of the impact on a power-law spring."""
    b, gamma = run.bodies, run.value("contact", "gamma_n")
    damping = run.value("contact", "eta_n") * TIME / b.mass[0]
    for k in range(b.n):
        v = -b.velocity[0, k, 2] * TIME / LENGTH
        begun = 1e-3
        force, weight = b.contact_force[:, k, 2], np.diff(b.time, prepend=0.0)
        touching = np.flatnonzero(force > 0.0)
        last = touching[-1]
        # the force of the last row is a mean over its step, of which it acts a part
        before, ended = force[last - 1], b.time[last] - weight[last]
        slope = (force[last - 2] - before) / weight[last]
        share = min(1.0, float(np.sqrt(2.0 * force[last] / max(slope * weight[last], 1e-300))))
        if force[last] > slope * weight[last] / 2:  # ends abruptly, as far as the rows show
            share = 1.0
        took = (ended + share * weight[last] - begun) / TIME
        e = b.velocity[-1, k, 2] / -b.velocity[0, k, 2]
        if damping == 0.0:
            _, depth, _, duration = next(r for r in rows("D3_power.csv") if np.isclose(r[0], gamma))
            name = f"power {gamma:g}:"
            checks.close(f"{name} restitution", e, 1.0, BAND)
            ours = (0.02 - b.position[:, k, 2].min()) / LENGTH
            checks.close(f"{name} depth [k=m=1]", ours, depth, BAND)
        else:
            row = next(r for r in rows("D3_hertz.csv") if np.allclose(r[:2], (v, damping)))
            name = f"Hertz, c = {damping:.1f}, v = {v:g}:"
            checks.close(f"{name} restitution", e, row[4], BAND)
            duration = row[5]
        checks.close(f"{name} duration [k=m=1]", took, duration, BAND)


def check(runs: list[Run], checks: Checks) -> None:
    """Each run by its kind."""
    for run in runs:
        kind = run.folder.name
        if kind.startswith("ball"):
            ball(run, checks)
        elif kind.startswith(("hertz", "power")):
            power_law(run, checks)
        else:
            restitution(run, checks)
