"""The places of units in the files that a survey takes: a table, GeoJSON, DXF and a raster."""

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from micstools import files
from micstools.piles import layer, pile_form
from micstools.piles.layer import Layer, Maps, parted
from micstools.piles.options import Options
from micstools.reading import places
from micstools.reading.overlap import Placed
from micstools.reading.places import Landing, Place, Survey, Within, row_of
from micstools.reading.reader import BadRun, Run
from micstools.reading.units import Units
from micstools.shapes.geometry import Array


@dataclass(frozen=True)
class Handover:
    """What is handed over of one run."""

    run: Run
    told: Options

    @property
    def survey(self) -> Survey:
        """Where the tank lies."""
        return self.told.survey

    @cached_property
    def places(self) -> list[Place]:
        """Of all units."""
        return places.places(self.run, self.survey)

    @cached_property
    def measured(self) -> tuple[Maps, Layer] | None:
        """The layer and its maps; none without units."""
        return layer.of_run(self.run, layers=self.told.layers, area=self.told.corners(self.run))

    @property
    def maps(self) -> Maps | None:
        return self.measured[0] if self.measured else None

    @property
    def within(self) -> Within | None:
        """How many units lie within the tolerance, as a rule half the nominal diameter; none
        without a plan."""
        if not (self.measured and places.has_plan(self.run)):
            return None
        usual = places.TOLERANCE * self.measured[1].nominal_diameter
        return places.within(self.places, self.told.tolerance or usual)

    def words(self, shown: Units) -> list[str]:
        """Share within the tolerance, and the layer, in sentences."""
        said = [places.share_words(self.within, shown.length)] if self.within else []
        return said + (layer.words(self.measured[1], shown) if self.measured else [])

    @property
    def about(self) -> dict[str, Any]:
        """The same for files, in SI units."""
        found: dict[str, Any] = {}
        if self.measured:
            found["layer"] = asdict(self.measured[1]) | {"definitions": layer.DEFINITIONS}
        if self.within:
            found["within"] = asdict(self.within) | {"share": self.within.share}
        return found

    @property
    def outlines(self) -> list[tuple[str, Array]]:
        """Outlines of the layer, closed lines (k, 2) in coordinates of the survey [m]."""
        found = self.maps.outlines() if self.maps else {}
        return [(name, self.survey.of(line)) for name, lines in found.items() for line in lines]

    @property
    def bodies(self) -> dict[int, Placed]:
        """The released bodies by their number from 0; a way through a period goes on."""
        units, others = parted(self.run)
        ends = places.ends(self.run)
        found = {k: b.moved(ends[k] - b.position) for k, b in (units | others).items()}
        return dict(sorted(found.items()))

    def hull(self, body: Placed) -> Array:
        """The smallest convex plan that holds a body: a closed line (k, 2) [m]."""
        corners = pile_form.hull(np.unique(body.points[:, :2], axis=0))
        return self.survey.of(np.concatenate([corners, corners[:1]]))


def to_csv(given: Handover, path: Path) -> Path:
    """A row per unit."""
    files.write(path, places.csv_text(given.places))
    return path


def to_geojson(given: Handover, path: Path) -> Path:
    """Per unit a point, and its plan as a polygon; outlines of the layer as lines."""
    found = []
    for p in given.places:
        if p.x == p.x:
            found.append(_feature("Point", [p.x, p.y, p.z], "unit", row_of(p)))
    for k, body in given.bodies.items():
        place, line = given.places[k], given.hull(body).tolist()
        found.append(_feature("Polygon", [line], "plan", {"unit": place.unit, "name": place.name}))
    for surface, line in given.outlines:
        found.append(_feature("LineString", line.tolist(), "outline", {"surface": surface}))
    return _collection(path, found, given.survey.crs)


def landings_to_geojson(found: Iterable[Landing], contours: dict[float, list[Array]], path: Path,
                        crs: str | None = None) -> Path:  # fmt: skip
    """Per unit the middle and the ellipse of its landings; lines around where a unit covers the
    ground with a probability."""
    features = []
    for one in found:
        about: dict[str, object] = {name: "" if value != value else value
                                    for name, value in landing_row(one).items()}  # fmt: skip
        features.append(_feature("Point", [one.x, one.y], "landing", about))
        if one.long == one.long:
            middle = np.array([one.x, one.y])
            line = places.ellipse_line(middle, one.long, one.short, one.heading_deg)
            features.append(_feature("Polygon", [line.tolist()], "ellipse", about))
    for probability, lines in contours.items():
        for line in lines:
            about = {"probability": probability}
            features.append(_feature("LineString", line.tolist(), "cover", about))
    return _collection(path, features, crs)


def landing_row(one: Landing) -> dict[str, object]:
    """A landing as a row of a table."""
    low, high = one.within.interval_95
    return {
        "unit": one.unit, "name": one.name, "landings": one.landings, "x": one.x, "y": one.y,
        "ellipse_long": one.long, "ellipse_short": one.short,
        "ellipse_heading_deg": one.heading_deg, "within": one.within.count,
        "share": one.within.share, "share_low": low, "share_high": high,
    }  # fmt: skip


def _feature(kind: str, where: Any, what: str, about: dict[str, object]) -> dict[str, Any]:
    about = {name: None if value == "" else value for name, value in about.items()}
    return {
        "type": "Feature",
        "geometry": {"type": kind, "coordinates": where},
        "properties": {"kind": what, **about},
    }


def _collection(path: Path, found: list[dict[str, Any]], crs: str | None) -> Path:
    content: dict[str, Any] = {"type": "FeatureCollection"}
    if crs:
        content["crs"] = {"type": "name", "properties": {"name": crs_name(crs)}}
    files.write(path, json.dumps(content | {"features": found}, allow_nan=False) + "\n")
    return path


def crs_name(word: str) -> str:
    """The name of a system of coordinates, as EPSG:25832."""
    code = word.upper().removeprefix("EPSG:")
    if not code.isdigit():
        raise BadRun(f"--crs {word}: must be as EPSG:25832")
    return f"urn:ogc:def:crs:EPSG::{code}"


def to_dxf(given: Handover, path: Path) -> Path:
    """The true shapes as meshes, plans, numbers, ways from the planned places and outlines, a layer
    each, in m."""
    from ezdxf.render.mesh import MeshBuilder

    drawing, space = _drawing(given.survey.crs)
    for k, body in given.bodies.items():
        p = given.places[k]
        here = {"layer": "UNITS"}
        mesh = MeshBuilder()
        mesh.vertices = [tuple(v) for v in given.survey.of(body.points).tolist()]
        mesh.faces = body.shape.triangles.tolist()
        mesh.render_mesh(space, dxfattribs=here)
        space.add_lwpolyline(given.hull(body).tolist(), dxfattribs={"layer": "PLANS"})
        space.add_point((p.x, p.y, p.z), dxfattribs={"layer": "CENTROIDS"})
        size = 0.2 * body.shape.length
        text = space.add_text(p.name or str(p.unit), height=size, dxfattribs={"layer": "NAMES"})
        text.set_placement((p.x, p.y, p.z))
        if p.plan_x == p.plan_x and not p.fixed:
            ends = (p.plan_x, p.plan_y, p.z), (p.x, p.y, p.z)
            space.add_line(*ends, dxfattribs={"layer": "DEVIATIONS"})
    for surface, line in given.outlines:
        name = f"OUTLINE_{surface.upper()}"
        space.add_lwpolyline(line.tolist(), dxfattribs={"layer": name})
    drawing.saveas(path)
    return path


def landings_to_dxf(found: Iterable[Landing], contours: dict[float, list[Array]],
                    path: Path, crs: str | None = None) -> Path:  # fmt: skip
    """The ellipses of landing with the numbers of their units, and lines of cover."""
    drawing, space = _drawing(crs)
    for one in found:
        text = space.add_text(one.name or str(one.unit), dxfattribs={"layer": "NAMES"})
        text.set_placement((one.x, one.y))
        if one.long == one.long:
            middle = np.array([one.x, one.y])
            line = places.ellipse_line(middle, one.long, one.short, one.heading_deg)
            space.add_lwpolyline(line.tolist(), dxfattribs={"layer": "ELLIPSES"})
            text.dxf.height = 0.3 * one.long
    for probability, lines in contours.items():
        for line in lines:
            name = f"COVER_{100 * probability:.0f}"
            space.add_lwpolyline(line.tolist(), dxfattribs={"layer": name})
    drawing.saveas(path)
    return path


def _drawing(crs: str | None) -> tuple[Any, Any]:
    """An empty drawing in m, which notes the system of the survey, and its model space."""
    from ezdxf.filemanagement import new
    from ezdxf.units import M

    drawing = new("R2010", units=M)
    if crs:
        drawing.header.custom_vars.append("CRS", crs_name(crs))
    for name, colour in _LAYERS.items():
        drawing.layers.add(name, color=colour)
    return drawing, drawing.modelspace()


_LAYERS = {
    "UNITS": 8, "PLANS": 7, "CENTROIDS": 1, "NAMES": 3, "DEVIATIONS": 1, "OUTLINE_BALL": 5,
    "OUTLINE_MEAN": 4, "ELLIPSES": 2, "COVER_10": 4, "COVER_50": 5, "COVER_90": 6,
}  # fmt: skip
"""Layers of a drawing and their colours, as AutoCAD numbers them."""


def raster(path: Path, values: Array, survey: Survey, low: Array, step: float) -> Path:
    """A map (ny, nx) on squares of `step` [m] from the corner `low` (2) as an Esri raster."""
    if survey.north:
        raise BadRun("a raster has its rows along east: with --north there is none")
    corner = survey.of(np.asarray(low[:2], float))
    rows, columns = values.shape
    head = {"ncols": columns, "nrows": rows, "xllcorner": repr(float(corner[0])),
            "yllcorner": repr(float(corner[1])), "cellsize": repr(step),
            "NODATA_value": -9999}  # fmt: skip
    lines = [f"{name} {value}" for name, value in head.items()]
    lines += [" ".join(f"{v:.9g}" for v in row) for row in np.nan_to_num(values[::-1], nan=-9999)]
    files.write(path, "\n".join(lines) + "\n")
    return path


WRITERS: dict[str, Callable[..., Path]] = {"csv": to_csv, "geojson": to_geojson, "dxf": to_dxf}
"""What can be written of one run, by its ending."""
