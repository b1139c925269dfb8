"""The tank of a run drawn again and again as time goes on, for films: what does not change is built
once."""

import numpy as np
from PIL import Image

from micstools.pictures import scene
from micstools.pictures.scene import Camera
from micstools.reading.reader import Run
from micstools.shapes.geometry import rotation_matrix


class Reel:
    """Tank, bed, blocks and water of a run, without words.

    Edges are not smoothed and translucent surfaces not sorted: without a graphics card both take
    most of the time of a picture, and the water has one colour, whatever comes first.
    """

    def __init__(self, run: Run, width: int, aspect: float, water: bool) -> None:
        """Build everything for pictures `width` [pixels] wide and `aspect` times as high; `water`:
        show that of the written fields, or of a light run."""
        self.run = run
        self._wet = water and run.field_times.size > 0
        self._field_time = np.nan
        self._plotter = plotter = scene.new_plotter(width, int(width * aspect))
        plotter.disable_anti_aliasing()
        plotter.disable_depth_peeling()
        plotter.suppress_rendering = True
        scene.add_tank(plotter, run.grid.low, run.grid.high)
        scene.add_bed(plotter, run)
        if water:
            scene.add_still_water(plotter, run)
        colours = scene.block_colours(run)
        shapes = [run.shapes[name] for name in run.bodies.shape]
        self._blocks = [
            scene.add_block(plotter, shape.points, shape, colour)
            for shape, colour in zip(shapes, colours, strict=True)
        ]

    def close(self) -> None:
        """Free what the graphics library holds."""
        self._plotter.close()

    def draw(self, t: float, camera: Camera) -> Image.Image:
        """The picture of the row nearest to `t` [s]; the water is that of the nearest written
        field."""
        b, row = self.run.bodies, self.run.bodies.row(t)
        present, place = b.there(row), self.run.into_tank(b.position[row])
        for k, actors in enumerate(self._blocks):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = rotation_matrix(b.quaternion[row, k]), place[k]
            for actor in actors:
                actor.visibility = bool(present[k])
                actor.user_matrix = pose
        if self._wet:
            fields = self.run.fields_at(t)
            if fields.time != self._field_time:
                scene.add_water(self._plotter, self.run, fields)
                self._field_time = fields.time
        scene.look(self._plotter, camera)
        self._plotter.suppress_rendering = False
        self._plotter.render()
        found = self._plotter.screenshot(return_img=True)
        self._plotter.suppress_rendering = True
        return Image.fromarray(found).convert("RGB")
