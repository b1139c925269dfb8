"""Pictures of tank, water and blocks, drawn off screen with pyvista.

pyvista is imported when the first picture is made: without the system's OpenGL libraries it ends
the process instead of raising an error, so `missing_libraries` has to be asked first.
"""

import ctypes
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from micstools import extras
from micstools.pictures import labels
from micstools.piles import pile
from micstools.reading import units, vtk_data
from micstools.reading.overlap import Placed, present_bodies
from micstools.reading.reader import Fields, Run
from micstools.reading.vtk_data import moved, triangles_of
from micstools.shapes.geometry import Array, IntArray
from micstools.shapes.shape import Shape

Plotter = Any  # pyvista.Plotter, which is imported late
WATER = "#7fb8e6"
TINT: dict[str, Any] = {"color": WATER, "opacity": 0.12, "lighting": False}
WATER_PARTS = ("surface of the water", "body of the water")
BED = "#b7a78c"
FIXED = ("#8d8d8d", "#a3a3a3", "#777777")
DROPPED = ("#d1495b", "#edae49", "#00798c", "#6a4c93", "#66a182", "#f28482", "#2e4057", "#b5838d")
VIEWS = ("front", "side", "top")
# Direction to the viewer, and tangent of half the angle of view across.
_SIGHT = {
    "front": (np.array([0.0, -1.0, 0.22]), 0.16),
    "side": (np.array([1.0, 0.0, 0.12]), 0.06),
    "top": (np.array([0.0, -0.02, 1.0]), 0.05),
}
ARROW = 0.12  # length of an arrow of the speed of a style, over the height of the tank
STILL = 1e-4  # [m/s] below this no arrows are drawn
HIGHEST = 2.6  # height of a picture over its width; a slice of a tank has room at its sides


@dataclass(frozen=True)
class Camera:
    """Where the viewer stands so that the whole tank fills the picture."""

    focus: Array  # (3) [m]
    position: Array  # (3) [m]
    angle: float  # of view, vertical [degrees]
    aspect: float  # height of the picture over its width

    @property
    def width_at_focus(self) -> float:
        """What the picture shows across, as far away as the focus [m]."""
        distance = float(np.linalg.norm(self.position - self.focus))
        return float(2 * distance * np.tan(np.radians(self.angle / 2)) / self.aspect)


@dataclass(frozen=True)
class Style:
    """Size and contents of a picture."""

    width: int = 1200  # [pixels]
    arrows: bool = True
    water: bool = True
    label: bool = True  # numbers on the blocks; time, arrow and length above
    speed: float = 0.0  # of an arrow `ARROW` long [m/s], 0: as suits the picture


def missing_libraries() -> str:
    """Why nothing can be drawn on this machine and what to install; empty where all is there."""
    if not sys.platform.startswith("linux"):
        return ""
    wanted = {"libEGL.so.1": "libegl1", "libGL.so.1": "libgl1"}
    missing = [package for library, package in wanted.items() if not _loads(library)]
    if not missing:
        return ""
    return f"drawing needs OpenGL libraries that are not here: apt-get install {' '.join(missing)}"


def require_libraries() -> None:
    """Refuse to draw without pyvista; end the program with exit code 1 and the command to run
    where the system's libraries are missing."""
    extras.need("pictures")
    problem = missing_libraries()
    if problem:
        print(problem, file=sys.stderr)
        raise SystemExit(1)


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def picture(run: Run, t: float, view: str, path: Path, style: Style | None = None) -> Path:
    """Draw the run at time `t` [s] seen from the `front` (along +y), the `side` (along -x) or the
    `top`, from where the water would only veil the blocks: without it and its arrows.

    With fluid the picture is that of the written field nearest to `t`; the water of a light run is
    drawn at rest.
    """
    style = style or Style()
    fields = run.fields_at(t) if run.field_times.size else None
    row = run.bodies.row(t if fields is None else fields.time)
    if view == "top":
        fields = None
    camera = camera_for(run.grid.low, run.grid.high, view)
    width = style.width if view != "side" else int(0.55 * style.width)
    shown = fields if style.water else None
    still_water = style.water and view != "top"
    # Tank, bed, blocks at a row and the water of some fields, or that of a light run
    plotter = new_plotter(width, int(width * camera.aspect))
    # One actor for all blocks of a colour: thousands are drawn in seconds
    colours = block_colours(run)
    alike: dict[str, list[Placed]] = {}
    for k, body in present_bodies(run, row, held=True).items():
        alike.setdefault(colours[k], []).append(body)
    for colour, bodies in alike.items():
        faces = [triangles_of(body.points, body.shape.triangles) for body in bodies]
        edges = [_lines(body.points, body.shape.edges) for body in bodies]
        _add_solid(plotter, vtk_data.joined(faces), vtk_data.joined(edges), colour)
    add_tank(plotter, run.grid.low, run.grid.high)
    add_bed(plotter, run)
    if shown is not None:
        add_water(plotter, run, shown)
    if still_water:
        add_still_water(plotter, run)
    arrows = Arrows(np.empty((0, 3)), np.empty((0, 3)))
    if fields is not None and style.arrows:
        arrows = arrows_of(run, fields, view)
    speed = style.speed if arrows.velocity.size and style.speed else usual_speed(arrows.velocity)
    height = float(run.grid.high[2] - run.grid.low[2])
    _add_arrows(plotter, arrows, speed, ARROW * height)
    look(plotter, camera)
    image = Image.fromarray(plotter.screenshot(return_img=True)).convert("RGB")
    if style.label:
        labels.number_blocks(image, _block_numbers(plotter, run, row, camera))
        keys = _keys(run, speed, width / camera.width_at_focus, view)
        places = 4 if run.bodies.time[-1] < 2 else 2
        image = labels.with_header(image, f"t = {run.bodies.time[row]:.{places}f} s", keys)
    plotter.close()
    image.save(path)
    return path


def arrow_speed(run: Run, times: list[float], views: list[str]) -> float:
    """Speed [m/s] that gives the pictures of these times and views one scale of their arrows, as
    `Style.speed`."""
    if not run.field_times.size:
        return 0.0
    sides = [view for view in views if view != "top"]
    found = [arrows_of(run, run.fields_at(t), view).velocity for t in times for view in sides]
    return usual_speed(np.concatenate(found)) if found else 0.0


def usual_speed(velocity: Array) -> float:
    """Speed [m/s] that few of the velocities (n, 3) exceed: a splash does not make all others
    dots."""
    speeds = np.linalg.norm(velocity, axis=1)
    return float(np.percentile(speeds, 99)) if speeds.size else 0.0


def telling_views(run: Run) -> list[str]:
    """The views of a run; a slice one cell thick is seen from its flat side only, and a tank
    without blocks not from the top."""
    cells = [len(faces) - 1 for faces in run.grid.faces]
    hidden = {
        "side": cells[1] == 1,
        "front": cells[0] == 1 and cells[1] > 1,
        "top": 1 in cells[:2] or not run.bodies.n,
    }
    return [view for view in VIEWS if not hidden[view]]


def _keys(run: Run, speed: float, pixels: float, view: str) -> list[labels.Key]:
    """What an arrow and a length mean, in the middle of the tank, `pixels` to the metre."""
    size = run.grid.high - run.grid.low
    keys = []
    if speed > STILL:
        told = labels.round_below(speed)
        length = told / speed * ARROW * float(size[2])
        keys.append(labels.Key("arrow", round(pixels * length), f"{told:g} m/s"))
    length = labels.round_below(0.25 * float(size[1 if view == "side" else 0]))
    text = units.of_run(run).length.plain(length)
    return [*keys, labels.Key("bar", round(pixels * length), text)]


def _block_numbers(plotter: Plotter, run: Run, row: int, camera: Camera) -> labels.Ids:
    """Number of the block seen at each pixel (height, width), 0 elsewhere: the scene once more,
    each block in a colour that is its number."""
    plotter.clear_actors()
    plotter.disable_anti_aliasing()
    flat = {"lighting": False, "smooth_shading": False}
    blocks = vtk_data.blocks(run, row)
    if blocks:
        faces = vtk_data.joined(list(blocks.values()))
        number = faces.cell_data["body"].astype(np.int64)
        colour = np.stack([number % 256, number // 256 % 256, number // 65536], axis=1).astype("u1")
        plotter.add_mesh(faces, scalars=colour, rgb=True, preference="cell", **flat)
    add_bed(plotter, run, color="white", **flat)
    look(plotter, camera)
    seen = np.asarray(plotter.screenshot(return_img=True))[..., :3].astype(np.int64)
    ids = seen @ np.array([1, 256, 65536])
    return np.where(ids <= run.bodies.n, ids, 0)


def new_plotter(width: int, height: int, **more: Any) -> Plotter:
    """A plotter without a window, its picture so large [pixels]."""
    import pyvista as pv
    import vtk

    vtk.vtkObject.GlobalWarningDisplayOff()
    plotter: Plotter = pv.Plotter(off_screen=True, window_size=[width, height], **more)
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_depth_peeling(8)
    return plotter


def block_colours(run: Run) -> list[str]:
    """Colour of each block: greys where it is fixed, else by its turn."""
    order = {int(k): n for n, k in enumerate(run.bodies.dropped)}
    still = [int(k) for k in np.flatnonzero(run.bodies.fixed)]
    return [
        DROPPED[order[k] % len(DROPPED)] if k in order else FIXED[still.index(k) % len(FIXED)]
        for k in range(run.bodies.n)
    ]


def add_block(plotter: Plotter, points: Array, shape: Shape, colour: str) -> tuple[Any, Any]:
    """Add the faces and the edges of a block whose corners are at `points` (n, 3) [m]; returns
    both actors."""
    faces = triangles_of(points, shape.triangles)
    return _add_solid(plotter, faces, _lines(points, shape.edges), colour)


def _add_solid(plotter: Plotter, faces: Any, edges: Any, colour: str) -> tuple[Any, Any]:
    surface = plotter.add_mesh(
        faces, color=colour, smooth_shading=False, ambient=0.35, diffuse=0.75, specular=0.1
    )
    return surface, plotter.add_mesh(edges, color="#303030", line_width=1.5)


def _lines(points: Array, edges: IntArray) -> Any:
    import pyvista as pv

    return pv.PolyData(points, lines=np.hstack([np.full((len(edges), 1), 2), edges]).ravel())


def add_tank(plotter: Plotter, low: Array, high: Array) -> None:
    """Add the edges of the tank and its floor."""
    import pyvista as pv

    x, y, z = high - low
    frame = pv.Box(bounds=[0, x, 0, y, 0, z]).extract_all_edges()
    plotter.add_mesh(moved(frame, low), color="#505050", line_width=2)
    floor = pv.Box(bounds=[0, x, 0, y, -0.012 * z, -0.002 * z])
    plotter.add_mesh(moved(floor, low), color="#e8e4dc", ambient=0.4)


def add_bed(plotter: Plotter, run: Run, **look: Any) -> None:
    """The surface of the bed in the tank, and below its border the sides of the tank."""
    import pyvista as pv

    points, triangles = run.bed
    if not len(triangles):
        return
    low, high = run.grid.low, run.grid.high
    bed = triangles_of(points, triangles)
    for d in range(2):
        for side, at in ((1, low), (-1, high)):
            normal = np.zeros(3)
            normal[d] = side
            bed = bed.clip(normal=normal, origin=at, invert=False)
    if not bed.n_cells:
        return
    look = look or {"color": BED, "smooth_shading": False, "ambient": 0.4, "diffuse": 0.7}
    plotter.add_mesh(bed, **look)
    others = dict.fromkeys(("feature_edges", "manifold_edges", "non_manifold_edges"), False)
    edges = bed.extract_feature_edges(boundary_edges=True, **others)
    if not edges.n_cells:
        return
    if "ambient" in look:
        plotter.add_mesh(edges, color="#303030", line_width=1.5)
    ends = np.asarray(edges.lines).reshape(-1, 3)[:, 1:]
    below = np.array(edges.points)
    below[:, 2] = low[2]
    fours = np.column_stack([np.full(len(ends), 4), ends, ends[:, ::-1] + len(below)])
    walls = pv.PolyData(np.vstack([edges.points, below]), faces=fours.ravel())
    plotter.add_mesh(walls, **look)


def add_water(plotter: Plotter, run: Run, fields: Fields) -> None:
    """Add the water surface where no solid is, and the body of water as a faint tint, in place of
    those of another time."""
    for name in WATER_PARTS:
        plotter.remove_actor(name, render=False)
    surface, body = vtk_data.water(run, fields)
    if surface.n_points:
        look = {"opacity": 0.6, "specular": 0.6, "specular_power": 30}
        plotter.add_mesh(surface, name=WATER_PARTS[0], color=WATER, smooth_shading=True, **look)
    if body.n_points:
        plotter.add_mesh(body, name=WATER_PARTS[1], **TINT)


def add_still_water(plotter: Plotter, run: Run) -> None:
    """Add the water of a light run, which has no fields, at its level at rest."""
    import pyvista as pv

    level = pile.still_level(run) if run.physics == "light" else None
    if level is None:
        return
    low, size = run.grid.low, run.grid.high - run.grid.low
    x, y, z = 1e-3 * size  # not in the sides of a bed
    depth = min(level - low[2], size[2])
    body = pv.Box(bounds=[-x, size[0] + x, -y, size[1] + y, -z, depth])
    plotter.add_mesh(moved(body, low), name=WATER_PARTS[1], **TINT)
    surface = pv.Plane(center=[*size[:2] / 2, depth], i_size=size[0], j_size=size[1])
    plotter.add_mesh(moved(surface, low), name=WATER_PARTS[0], **TINT | {"opacity": 0.4})


@dataclass(frozen=True)
class Arrows:
    """Velocities of the water in the middle plane that faces the viewer."""

    points: Array  # (n, 3) [m]
    velocity: Array  # (n, 3) in that plane [m/s]


def arrows_of(run: Run, fields: Fields, view: str) -> Arrows:
    """Where arrows stand in a view: about 20 in each direction, in water free of solid."""
    axis = 1 if view == "front" else 0
    x, y, z = run.grid.centres
    here = [x, y, z]
    middle = len(here[axis]) // 2
    here[axis] = here[axis][middle : middle + 1]
    points = np.stack(np.meshgrid(*reversed(here), indexing="ij")[::-1], axis=-1)
    cut = [slice(None)] * 3
    cut[2 - axis] = slice(middle, middle + 1)
    index = tuple(cut)
    velocity = fields.velocity[index].astype(float)
    velocity[..., axis] = 0.0
    wet = (fields.liquid[index] > 0.5) & (fields.solid[index] < 0.01)
    every = np.zeros(wet.shape, bool)
    every[tuple(slice(None, None, 1 if n == 1 else max(1, round(n / 20))) for n in wet.shape)] = (
        True
    )
    return Arrows(points[wet & every], velocity[wet & every])


def _add_arrows(plotter: Plotter, arrows: Arrows, unit: float, length: float) -> None:
    """Draw arrows; one of the speed `unit` [m/s] is `length` [m] long."""
    import pyvista as pv

    speed = np.linalg.norm(arrows.velocity, axis=1)
    chosen = speed > 0.02 * unit
    if unit < STILL or not chosen.any():
        return
    points = arrows.points[chosen]
    cloud = pv.PolyData(points - points[0])
    cloud["velocity"] = arrows.velocity[chosen]
    arrow = pv.Arrow(tip_length=0.3, tip_radius=0.09, shaft_radius=0.025)
    glyphs = cloud.glyph(orient="velocity", scale="velocity", factor=length / unit, geom=arrow)
    plotter.add_mesh(moved(glyphs, points[0]), color="#1d3557", ambient=0.5)


def camera_around(low: Array, high: Array, angle_deg: float) -> Camera:
    """Camera that goes round the box: from the front at 0, from +x at 90 degrees; it is always as
    far away, and its picture three quarters as high as wide."""
    turn, angle = np.radians(angle_deg), 26.0
    towards = np.array([np.sin(turn), -np.cos(turn), 0.4])
    towards = towards / np.linalg.norm(towards)
    focus, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    distance = 0.92 * radius / np.sin(np.radians(angle / 2))
    return Camera(focus, focus + distance * towards, angle, 0.75)


def camera_for(low: Array, high: Array, view: str) -> Camera:
    """Camera that sees the box from the `front` or the `side`, slightly from above, or from the
    `top`."""
    towards, half_width = _SIGHT[view]
    towards = towards / np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(towards, right), towards])
    ends = np.stack([low, high])
    corner = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])
    focus = (low + high) / 2
    for _ in range(3):  # shifts the focus until the picture is centred
        across, up, near = axes @ (corner - focus).T
        widest = np.maximum(np.abs(across), np.abs(up) / HIGHEST)
        distance = float((widest / half_width + near).max()) * 1.04
        height = up / (distance - near)
        middle = (height.max() + height.min()) / 2
        half_height = 1.04 * (height.max() - height.min()) / 2
        focus = focus + axes[1] * distance * middle
    angle = 2 * np.degrees(np.arctan(half_height))
    return Camera(focus, focus + distance * towards, float(angle), float(half_height / half_width))


def look(plotter: Plotter, camera: Camera) -> None:
    """See what there is from a camera."""
    plotter.camera.focal_point = camera.focus
    plotter.camera.position = camera.position
    plotter.camera.up = (0, 0, 1)
    plotter.camera.view_angle = camera.angle
    plotter.reset_camera_clipping_range()


def shape_picture(shape: Shape, path: Path, width: int = 1500) -> Path:
    """The paper's figure 1: polygons, tetrahedra and contact spheres of a shape, side by side."""
    import pyvista as pv

    plotter = new_plotter(width, width // 3, shape=(1, 3), border=False)
    for column, title in enumerate(("polygons", "tetrahedra", "contact spheres")):
        plotter.subplot(0, column)
        plotter.add_text(title, position=(0.05, 0.92), viewport=True, font_size=11, color="black")
        if column == 0:
            faces = triangles_of(shape.points, shape.triangles)
            plotter.add_mesh(faces, color="#c9a66b", ambient=0.25)
            plotter.add_mesh(_lines(shape.points, shape.edges), color="#303030", line_width=2)
        elif column == 1:
            ends = np.sort(shape.tets[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]], axis=2)
            wires = np.unique(ends.reshape(-1, 2), axis=0)
            plotter.add_mesh(_lines(shape.points, wires), color="#1d3557", line_width=1.2)
        else:
            cloud = pv.PolyData(shape.sphere_centre)
            cloud["diameter"] = 2 * shape.sphere_radius
            ball = pv.Sphere(radius=0.5, theta_resolution=20, phi_resolution=20)
            balls = cloud.glyph(scale="diameter", orient=False, geom=ball)
            plotter.add_mesh(balls, color="#c9a66b", smooth_shading=True, ambient=0.25)
        plotter.view_vector((-0.75, -1.0, 0.55), viewup=(0, 0, 1))
        plotter.camera.zoom(1.15)
    plotter.screenshot(str(path))
    plotter.close()
    return path
