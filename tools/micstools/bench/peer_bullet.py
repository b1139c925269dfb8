"""The dry pile of the bench by PyBullet (`pip install pybullet`).

usage: python -m micstools.bench.peer_bullet BLOCKS SECONDS

The blocks, their starts and the tank are those of `tools/bench_contact.py`; each is three bars.
Prints wall and CPU seconds, steps, and how deep blocks are in each other at the end [mm].
"""

import math
import sys
import time

import numpy as np

STEP = 1 / 240  # [s] Bullet's own
ROUNDS = 50  # of its solver, likewise
FRICTION, RESTITUTION = 0.5, 0.3  # of a pair; Bullet multiplies those of both bodies


def main(words: list[str]) -> None:
    """Drop, and tell."""
    import pybullet

    from micstools.bench.dry_pile import BOX, DENSITY, EDGE, start

    count, seconds = int(words[0]), float(words[1])
    pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81)
    pybullet.setPhysicsEngineParameter(fixedTimeStep=STEP, numSolverIterations=ROUNDS)
    bars = (0.5 + np.eye(3)) * EDGE
    shape = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * 3,
        halfExtents=bars.tolist(),
        collisionFramePositions=np.zeros((3, 3)).tolist(),
    )
    surface = {"lateralFriction": math.sqrt(FRICTION), "restitution": math.sqrt(RESTITUTION),
               "linearDamping": 0.0, "angularDamping": 0.0}  # fmt: skip
    walls = [((0, 0, 0), (0, 0, 1)), ((0, 0, 0), (1, 0, 0)), ((BOX, 0, 0), (-1, 0, 0)),
             ((0, 0, 0), (0, 1, 0)), ((0, BOX, 0), (0, -1, 0))]  # fmt: skip
    for place, normal in walls:
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, planeNormal=normal)
        body = pybullet.createMultiBody(0, plane, basePosition=place)
        pybullet.changeDynamics(body, -1, **surface)
    cube = DENSITY * EDGE**3
    inertia = cube * EDGE**2 * (7 / 6 + 4)
    for position, (w, x, y, z) in zip(*start(count, BOX, 1), strict=True):
        body = pybullet.createMultiBody(7 * cube, shape, basePosition=position.tolist(),
                                        baseOrientation=[x, y, z, w])  # fmt: skip
        pybullet.changeDynamics(body, -1, localInertiaDiagonal=[inertia] * 3, **surface)
    steps, began, cpu = round(seconds / STEP), time.perf_counter(), time.process_time()
    for _ in range(steps):
        pybullet.stepSimulation()
    wall, cpu = time.perf_counter() - began, time.process_time() - cpu
    depth = max((-point[8] for point in pybullet.getContactPoints()), default=0.0)
    print(f"{wall:.4f},{cpu:.4f},{steps},{1e3 * depth:.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
