"""Everything that is set on the node, validated.

Whether a value comes from a YAML file, the command line, a launch file or a parameter service:
it ends up in one flat mapping of parameter names to values, and `Settings.parse` is the only way
from there into the simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from hma_gripper_sim.device.setting_definitions import FIELDS, PLACEMENT_FIELDS, Value, field_of
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.contours.from_camera import polygon_from_outline
from hma_gripper_sim.model.contours.shapes import contour_from_mapping
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.model.joint_names import check_prefix
from hma_gripper_sim.motion.drive_limits import DriveLimits

DEFAULT_CONTOURS: Mapping[str, Value] = MappingProxyType(
    {
        "contours.box.type": "box",
        "contours.box.width": 0.028,
        "contours.box.height": 0.028,
        "contours.box.corner_radius": 0.002,
        "contours.box.clearance": 0.004,
        "contours.cylinder.type": "circle",
        "contours.cylinder.radius": 0.015,
        "contours.cylinder.clearance": 0.005,
        "contours.wedge.type": "polygon",
        "contours.wedge.points": [-0.016, -0.014, 0.016, -0.014, 0.012, 0.014, -0.012, 0.014],
        "contours.wedge.rounding": 0.002,
        "contours.wedge.clearance": 0.004,
    }
)
"""The objects of the thesis and a wedge: the catalogue where no `contours.*` is given."""

OUTLINE = "outline"
"""Name of the object whose outline comes by topic; no other may have it."""

Points = tuple[tuple[float, float], ...]

_SCENE_FIELDS = (
    "friction",
    "contact",
    "discretisation",
    "normal_stiffness",
    "normal_damping",
    "slip_velocity",
)


@dataclass(frozen=True)
class Settings:
    """A complete and consistent set of settings.

    Attributes
    ----------
    values
        Every setting by parameter name, in SI units.
    scenes
        The catalogue: what the gripper presses on, by object name.
    limits
        What the drive may do.
    period_ns
        Duration of a tick in simulated time [ns].
    outline
        The last outline that came by topic, as it was: (x, z) of its points [m].
    """

    values: Mapping[str, Value]
    scenes: Mapping[str, Scene]
    limits: DriveLimits
    period_ns: int
    outline: Points = ()

    @classmethod
    def parse(cls, given: Mapping[str, object]) -> Settings:
        """Validate what is given, and fill in the defaults.

        Parameters
        ----------
        given
            Values by parameter name: `FIELDS` and ``contours.NAME.FIELD`` with
            `CONTOUR_FIELDS`. Where no contour is given, `DEFAULT_CONTOURS` are taken.

        Raises
        ------
        InputError
            Naming the parameter: unknown, not finite, out of range, or inconsistent.
        """
        if not any(name.startswith("contours.") for name in given):
            given = {**DEFAULT_CONTOURS, **given}
        values: dict[str, Value] = {name: field.default for name, field in FIELDS.items()}
        values |= {name: field_of(name).read(value, name) for name, value in given.items()}
        scenes = _scenes(values, outline=())
        settings = cls(MappingProxyType(values), scenes, _limits(values), _period(values))
        settings._check_contour()
        check_prefix(settings.prefix, field="prefix")
        return settings

    def changed(self, changes: Mapping[str, object]) -> Settings:
        """Return these settings with some values changed; raise `InputError` as `parse` does.

        Scenes that the changes do not touch stay the same objects.
        """
        read = {name: field_of(name).read(value, name) for name, value in changes.items()}
        values = {**self.values, **read}
        touched = any(
            name in _SCENE_FIELDS or name.startswith(("contours.", "outline.")) for name in changes
        )
        settings = replace(
            self,
            values=MappingProxyType(values),
            scenes=_scenes(values, self.outline) if touched else self.scenes,
            limits=_limits(values),
            period_ns=_period(values),
        )
        settings._check_contour()
        return settings

    def with_outline(self, points: Points) -> Settings:
        """Return these settings with an outline as the object `OUTLINE` of the catalogue.

        Raises
        ------
        InputError
            It is no convex polygon of a sensible size.
        """
        scene = _outline_scene(self.values, points)
        return replace(self, scenes={**self.scenes, OUTLINE: scene}, outline=points)

    @property
    def contour(self) -> str:
        """Name of the object in place."""
        return str(self.values["contour"])

    @property
    def period(self) -> float:
        """Duration of a tick [s]."""
        return self.period_ns / 1e9

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second; 0: as fast as possible."""
        return float(self.values["real_time_factor"])  # type: ignore[arg-type]

    @property
    def publish_clock(self) -> bool:
        """Whether the node is the clock of all others."""
        return bool(self.values["publish_clock"])

    @property
    def prefix(self) -> str:
        """What stands before the names of joints and frames."""
        return str(self.values["prefix"])

    @property
    def moving_end(self) -> bool:
        """Whether trajectories may end in motion."""
        return bool(self.values["allow_nonzero_velocity_at_trajectory_end"])

    @property
    def step_ticks(self) -> int:
        """Ticks that one call of ~/step makes."""
        return int(self.values["step_ticks"])  # type: ignore[arg-type]

    @property
    def markers_rate(self) -> float:
        """How often markers are published [Hz]; 0: never."""
        return float(self.values["markers_rate"])  # type: ignore[arg-type]

    @property
    def tolerance(self) -> float:
        """Relative error the solver aims at."""
        return float(self.values["tolerance"])  # type: ignore[arg-type]

    def _check_contour(self) -> None:
        if self.contour == OUTLINE and not self.outline:
            raise InputError("no outline has come by ~/outline yet", field="contour")
        if self.contour not in self.scenes:
            known = ", ".join(sorted(self.scenes))
            raise InputError(f"unknown contour {self.contour!r} (known: {known})", field="contour")


def _limits(values: Mapping[str, Any]) -> DriveLimits:
    return DriveLimits(
        max_velocity=values["max_velocity"],
        max_acceleration=values["max_acceleration"],
        travel_min=values["travel_min"],
        travel_max=values["travel_max"],
        command_timeout=values["command_timeout"],
    )


def _period(values: Mapping[str, Any]) -> int:
    """Duration of a tick in whole nanoseconds, the resolution of ROS time stamps."""
    return round(1e9 / float(values["publish_rate"]))


def _scenes(values: Mapping[str, Any], outline: Points) -> dict[str, Scene]:
    """Build the scene of every contour of the catalogue."""
    common = _common(values)
    scenes = {}
    for name, shape in _contours(values).items():
        prefix = f"contours.{name}"
        if name == OUTLINE:
            raise InputError("the name is reserved for what comes by ~/outline", field=prefix)
        placement = {field: shape.pop(field) for field in PLACEMENT_FIELDS if field in shape}
        contour = contour_from_mapping(shape, field=prefix)
        try:
            scenes[name] = Scene(contour=contour, **common, **placement)
        except InputError as error:
            field = f"{prefix}.{error.field}" if error.field in PLACEMENT_FIELDS else error.field
            raise InputError(error.reason, field=field) from None
    if outline:
        scenes[OUTLINE] = _outline_scene(values, outline)
    return scenes


def _outline_scene(values: Mapping[str, Any], points: Points) -> Scene:
    contour = polygon_from_outline(points, values["outline.rounding"])
    return Scene(contour=contour, clearance=values["outline.clearance"], **_common(values))


def _common(values: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `Scene` that are the same for every object."""
    path, normal = values["design"], values["sampled_normal"]
    return {
        "design": GripperDesign.from_yaml(path) if path else GripperDesign.thesis_2013(),
        "sampled_normal": None if normal == "auto" else normal,
        **{field: values[field] for field in _SCENE_FIELDS},
        **{field: values[field] or None for field in ("elements_top", "elements_beam")},
    }


def _contours(values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Group ``contours.NAME.FIELD`` by name, and the points of polygons in pairs."""
    contours: dict[str, dict[str, Any]] = {}
    for full_name, value in values.items():
        if full_name.startswith("contours."):
            _, name, field = full_name.split(".")
            if field == "points":
                if len(value) % 2:
                    raise InputError("expected x and z in turn: an even count", field=full_name)
                value = [value[i : i + 2] for i in range(0, len(value), 2)]
            contours.setdefault(name, {})[field] = value
    return contours
