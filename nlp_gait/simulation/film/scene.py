"""The simulated robot seen from several sides, drawn off the screen."""

import math
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.errors import OutputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.film.recording import Recording
from nlp_gait.simulation.film.video import Frame

# By name: azimuth and elevation of the camera [degrees], and its visible height in heights of the robot.
CAMERAS = {
    "side": (90.0, -9.0, 1.4),
    "front": (180.0, -9.0, 1.4),
    "back": (0.0, -9.0, 1.4),
    "above": (90.0, -90.0, 0.6),
}
NARROWEST = 0.75  # width over height of a view below which the camera steps back
ARROW_HEIGHT = 0.45  # of the robot, for a force equal to its weight
FORCE, MEASURED, PLANNED = (0.0, 0.62, 0.45, 0.9), (0.05, 0.05, 0.05, 1.0), (0.8, 0.47, 0.65, 1.0)
DOT, ARROW_RADIUS = 0.012, 0.008  # of the robot's height
DOTS_ABOVE = 0.05  # of the robot's height, above the soles
FLAT = 0.0002  # [m]
TRAIL = 25  # number of earlier centres of pressure in the picture
MOST_GEOMETRIES = 2000


class View(NamedTuple):
    """Part of a picture [pixels]; the origin is the upper left corner."""

    name: str  # side, front, back or above
    left: int
    top: int
    width: int
    height: int


def find_stairs(model: Any) -> Any:
    """Return a mask of the geometries of the engine's model that are boxes on the floor."""
    return (model.geom_bodyid == 0) & (model.geom_type == load_mujoco().mjtGeom.mjGEOM_BOX)


class Scene:
    """Views of one recording, width by height [pixels]; call ``close`` at the end. Raises OutputError if nothing can be drawn."""

    def __init__(self, recording: Recording, views: Sequence[View], width: int, height: int) -> None:
        self._engine = engine = load_mujoco(pictures=True)
        self._recording, self._views, self._size = recording, views, (width, height)
        model = recording.model
        self._data = engine.MjData(model)
        self._pose(0)
        moving = model.geom_bodyid > 0
        self._height = float((self._data.geom_xpos[moving, 2] + model.geom_rbound[moving]).max())
        self._weight = float(model.body_mass.sum() * np.linalg.norm(model.opt.gravity))
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._surface: Any = None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the error below has the reason
                self._surface = engine.GLContext(width, height)
                self._surface.make_current()
                self._context = engine.MjrContext(model, engine.mjtFontScale.mjFONTSCALE_100)
        except Exception as error:  # any error of the graphics driver
            self.close()
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise OutputError(
                f"pictures cannot be drawn off the screen ({reason}); "
                "set MUJOCO_GL=egl or MUJOCO_GL=osmesa, if installed"
            ) from error
        engine.mjr_setBuffer(engine.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = engine.MjvScene(model, maxgeom=MOST_GEOMETRIES)
        self._whole, self._soles = engine.MjvOption(), engine.MjvOption()
        self._soles.geomgroup[1:] = 0

    def draw(self, k: int) -> Frame:
        """Return all views at one instant, (height, width, 3)."""
        engine, (width, height) = self._engine, self._size
        self._pose(k)
        self._surface.make_current()
        for view in self._views:
            above = view.name == "above"
            option = self._soles if above else self._whole
            camera = self._camera(view, k)
            kinds = engine.mjtCatBit.mjCAT_ALL
            engine.mjv_updateScene(self._recording.model, self._data, option, None, camera, kinds, self._scene)
            self._scene.flags[engine.mjtRndFlag.mjRND_SHADOW] = not above
            (self._add_dots if above else self._add_force)(k)
            # The engine's origin is the lower left corner.
            area = engine.MjrRect(view.left, height - view.top - view.height, view.width, view.height)
            engine.mjr_render(area, self._scene, self._context)
        pixels = np.empty((height, width, 3), dtype=np.uint8)
        engine.mjr_readPixels(pixels, None, engine.MjrRect(0, 0, width, height), self._context)
        return pixels[::-1]

    def close(self) -> None:
        """Release the drawing surface."""
        if self._surface is not None:
            self._surface.free()
            self._surface = None

    def _pose(self, k: int) -> None:
        self._data.qpos[:] = self._recording.states[k]
        self._engine.mj_kinematics(self._recording.model, self._data)
        self._engine.mj_comPos(self._recording.model, self._data)
        self._engine.mj_camlight(self._recording.model, self._data)

    def _camera(self, view: View, k: int) -> Any:
        """Return a camera that follows the robot without its sway."""
        camera = self._engine.MjvCamera()
        camera.azimuth, camera.elevation, seen = CAMERAS[view.name]
        path = self._recording.path
        above, climbed = view.name == "above", max(0.0, path[k, 2] - path[0, 2])
        x, y = self._recording.stand[k] if above else path[k, :2]
        camera.lookat[:] = (x, y, climbed + (0.0 if above else 0.45 * self._height))
        opening = math.tan(math.radians(float(self._recording.model.vis.global_.fovy)) / 2)
        step_back = max(1.0, NARROWEST * view.height / view.width)
        camera.distance = step_back * seen * self._height / (2 * opening)
        return camera

    def _add_force(self, k: int) -> None:
        """Add the floor's force as an arrow from the centre of pressure."""
        centre, load = self._recording.pressure[k], float(self._recording.load[k])
        if not np.isfinite(centre).all() or load <= 0.0:
            return
        foot = np.array([*centre, self._ground(*centre) + 0.001])
        tip = foot + (0.0, 0.0, ARROW_HEIGHT * self._height * load / self._weight)
        arrow, width = self._engine.mjtGeom.mjGEOM_ARROW, ARROW_RADIUS * self._height
        geometry = self._add(arrow, FORCE, np.zeros(3), np.zeros(3))
        if geometry is not None:
            self._engine.mjv_connector(geometry, arrow, width, foot, tip)

    def _add_dots(self, k: int) -> None:
        """Add the centre of pressure with its path, and the planned zero-moment point."""
        self._add_dot(self._recording.planned[k], 1.5, PLANNED, -0.001)
        begin = max(0, k - TRAIL)
        for i, centre in enumerate(self._recording.pressure[begin : k + 1], begin):
            share = 1.0 if i == k else 0.35
            self._add_dot(centre, share, MEASURED, 0.001 if i == k else 0.0)

    def _add_dot(self, centre: Any, share: float, colour: Sequence[float], over: float) -> None:
        if np.isfinite(centre).all():
            place = np.array([*centre, self._ground(*centre) + DOTS_ABOVE * self._height + over])
            size = np.array([share * DOT * self._height, FLAT, 0.0])
            self._add(self._engine.mjtGeom.mjGEOM_CYLINDER, colour, size, place)

    def _ground(self, x: float, y: float) -> float:
        """Return the height of the ground under a point [m]: the floor, or the highest box on it."""
        model = self._recording.model
        boxes = find_stairs(model)
        middles, halves = model.geom_pos[boxes], model.geom_size[boxes]
        under = (np.abs(middles[:, :2] - (x, y)) <= halves[:, :2]).all(axis=1)
        return float(max((middles[:, 2] + halves[:, 2])[under], default=0.0))

    def _add(self, kind: Any, colour: Sequence[float], size: Array, place: Array) -> Any:
        """Add a geometry to the scene; return None if it is full."""
        scene = self._scene
        if scene.ngeom >= scene.maxgeom:
            return None
        geometry = scene.geoms[scene.ngeom]
        scene.ngeom += 1
        self._engine.mjv_initGeom(geometry, kind, size, place, np.eye(3).ravel(), np.array(colour, dtype=np.float32))
        return geometry
