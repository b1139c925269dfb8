"""A run as a glTF file (.glb): each shape once, a named node per block that moves and turns.

Source: glTF 2.0 specification, Khronos Group. Its y axis is up, so all blocks hang in a node that
turns ours, z, there. That node stands at the lower corner of the tank, from which places count:
single precision would not hold coordinates of a survey.
"""

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from micstools.pictures.scene import DROPPED, FIXED
from micstools.reading.reader import Run
from micstools.shapes.geometry import Array, IntArray, normals
from micstools.shapes.shape import Shape

_FLOAT, _UNSIGNED = 5126, 5125
_UPRIGHT = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # x, y, z, w: a quarter turn about x, z becomes y
_MATT: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 0.9}
_GONE = 1e-6  # size of a block that is not there yet; zero has no inverse


@dataclass
class _Buffer:
    """The numbers of the file, and what tells where each array of them is."""

    content: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def add(self, values: NDArray[Any], kind: str, bounds: bool = False) -> int:
        """Append an array of SCALAR, VEC3 or VEC4 and give its number."""
        found = np.ascontiguousarray(values)
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.content), "byteLength": found.nbytes}
        )
        self.content += found.tobytes()
        component = _UNSIGNED if found.dtype == np.uint32 else _FLOAT
        about = {"bufferView": len(self.views) - 1, "componentType": component,
                 "count": len(found), "type": kind}  # fmt: skip
        if bounds:
            flat = found.reshape(len(found), -1)
            about |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        self.accessors.append(about)
        return len(self.accessors) - 1


def write(run: Run, rows: IntArray, path: Path) -> None:
    """Write the motion of the blocks at some rows of a run; the first is time 0 of the film."""
    buffer, b = _Buffer(), run.bodies
    arrays = {name: _arrays(buffer, shape) for name, shape in run.shapes.items()}
    order = {int(k): 1 + place % len(DROPPED) for place, k in enumerate(b.dropped)}
    meshes, nodes = [], []
    for k in range(b.n):
        part = arrays[b.shape[k]] | {"material": order.get(k, 0)}
        meshes.append({"name": b.shape[k], "primitives": [part]})
        nodes.append({"name": f"block {k + 1}", "mesh": k})
    times = (b.time[rows] - b.time[rows[0]]).astype(np.float32)
    moves = _animation(buffer, run, rows, times) if len(rows) > 1 else None
    for k in range(b.n):
        nodes[k] |= {
            "translation": (b.position[rows[0], k] - run.grid.low).tolist(),
            "rotation": _turns(b.quaternion[rows[:1], k])[0].tolist(),
        }
    x, y, z = run.grid.low.tolist()
    root = {
        "name": "tank",
        "translation": [x, z, -y],
        "rotation": _UPRIGHT,
        "children": list(range(b.n)),
    }
    content: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "mics-tools export"},
        "scene": 0,
        "scenes": [{"nodes": [b.n]}],
        "nodes": [*nodes, root],
        "meshes": meshes,
        "materials": [
            {"pbrMetallicRoughness": _MATT | {"baseColorFactor": [*_linear(colour), 1.0]}}
            for colour in (FIXED[0], *DROPPED)
        ],
        "buffers": [{"byteLength": len(buffer.content)}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    }
    path.write_bytes(_packed(content | ({"animations": [moves]} if moves else {}), buffer.content))


def _arrays(buffer: _Buffer, shape: Shape) -> dict[str, Any]:
    """Corners of the faces of a shape, each with the normal of its face."""
    corner = shape.points[shape.triangles]
    places = buffer.add(corner.reshape(-1, 3).astype(np.float32), "VEC3", bounds=True)
    across = buffer.add(np.repeat(normals(corner), 3, axis=0).astype(np.float32), "VEC3")
    return {"attributes": {"POSITION": places, "NORMAL": across}}


def _animation(buffer: _Buffer, run: Run, rows: IntArray, times: Array) -> dict[str, Any]:
    """Places and attitudes of all blocks; one that comes later has no size until then."""
    b = run.bodies
    clock = buffer.add(times, "SCALAR", bounds=True)
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []

    def add(k: int, what: str, values: Array, kind: str, way: str = "LINEAR") -> None:
        output = buffer.add(values.astype(np.float32), kind)
        channels.append({"sampler": len(samplers), "target": {"node": k, "path": what}})
        samplers.append({"input": clock, "output": output, "interpolation": way})

    for k in range(b.n):
        there = (b.entry_time[k] <= b.time[rows] + 1e-12) & (b.time[rows] < b.exit_time[k])
        if not there.all():
            size = np.where(there, 1.0, _GONE)
            add(k, "scale", np.repeat(size[:, None], 3, axis=1), "VEC3", "STEP")
        moves = np.ptp(b.position[rows, k], 0).any() or np.ptp(b.quaternion[rows, k], 0).any()
        if moves:
            add(k, "translation", b.position[rows, k] - run.grid.low, "VEC3")
            add(k, "rotation", _turns(b.quaternion[rows, k]), "VEC4")
    return {"name": "fall", "channels": channels, "samplers": samplers}


def _turns(quaternion: Array) -> Array:
    """Quaternions w, x, y, z as x, y, z, w of length one."""
    unit = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.asarray(np.roll(unit, -1, axis=1))


def _linear(colour: str) -> list[float]:
    """A colour as linear shares of red, green and blue."""
    shares = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    return [((s + 0.055) / 1.055) ** 2.4 if s > 0.04045 else s / 12.92 for s in shares]


def _packed(content: dict[str, Any], numbers: bytearray) -> bytes:
    """The two parts of a .glb file behind its header, each filled up to four bytes."""
    text = json.dumps(content, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    numbers = numbers + bytes(-len(numbers) % 4)
    whole = 12 + 8 + len(text) + 8 + len(numbers)
    head = struct.pack("<4sII", b"glTF", 2, whole)
    parts = struct.pack("<I4s", len(text), b"JSON") + text
    return head + parts + struct.pack("<I4s", len(numbers), b"BIN\0") + bytes(numbers)
