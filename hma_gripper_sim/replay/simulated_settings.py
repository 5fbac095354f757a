"""What a replay simulates, by the names and rules of the node's own parameters.

They come from the log itself where it is one of ours, from an experiment, and from options; the
node's `Settings` are the one place that validates them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hma_gripper_sim.bags.log_metadata import PARAMETERS_KEY
from hma_gripper_sim.device.parameter_file import read_parameter_file
from hma_gripper_sim.device.setting_definitions import PLACEMENT_FIELDS
from hma_gripper_sim.device.settings import Settings
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.yaml_reading import config_directory, load_yaml, read_yaml

_SCENE_ONLY = ("accuracy", "gravity")
"""Parameters of a scene that the node leaves at their defaults."""

_NO_EFFECT = (
    "real_time_factor",
    "publish_clock",
    "step_ticks",
    "markers_rate",
    "prefix",
    "allow_nonzero_velocity_at_trajectory_end",
)
"""Parameters of the node that mean nothing offline."""


@dataclass(frozen=True)
class SimulatedSettings:
    """A complete and consistent set of parameters.

    Attributes
    ----------
    given
        All of them by name, SI, as the log of the replay will hold them.
    contour
        Name of the object in place.
    scene
        What is simulated.
    limits
        What the drive may do.
    period_ns
        Of its ticks [ns].
    tolerance
        Relative error the solver aims at.
    """

    given: Mapping[str, object]
    contour: str
    scene: Scene
    limits: DriveLimits
    period_ns: int
    tolerance: float

    @classmethod
    def parse(cls, given: Mapping[str, object]) -> SimulatedSettings:
        """Validate what is given, and fill in the defaults.

        Parameters
        ----------
        given
            By the node's parameter names; also ``clearance`` and ``offset`` of the object in
            place, ``accuracy`` and ``gravity``.

        Raises
        ------
        InputError
            Naming the parameter.
        """
        for name in _NO_EFFECT:
            if name in given:
                raise InputError("means nothing in a replay", field=name)
        contour = given.get("contour", "box")
        placement = {
            f"contours.{contour}.{name}": given[name] for name in PLACEMENT_FIELDS if name in given
        }
        scene_only = {name: given[name] for name in _SCENE_ONLY if name in given}
        others = {
            name: value
            for name, value in given.items()
            if name not in (*PLACEMENT_FIELDS, *_SCENE_ONLY)
        }
        redefined = tuple(name.removesuffix("type") for name in others if name.endswith(".type"))
        known = {k: v for k, v in catalogue().items() if not k.startswith(redefined)}
        settings = Settings.parse({**known, **others, **placement})
        scene = settings.scenes[settings.contour]
        if scene_only:
            scene = replace(scene, **scene_only)  # type: ignore[arg-type]
        return cls(
            {**_of_scene(settings), **scene_only},
            settings.contour,
            scene,
            settings.limits,
            settings.period_ns,
            settings.tolerance,
        )


def catalogue() -> dict[str, object]:
    """Return the objects that the node knows when it is given its shipped parameter file."""
    parameters = read_parameter_file(config_directory() / "sim_node.yaml")
    return {name: value for name, value in parameters.items() if name.startswith("contours.")}


def metadata(given: Mapping[str, object]) -> dict[str, str]:
    """Return parameters as `logged_parameters` finds them in a log's metadata again.

    Those that mean nothing offline are left out; none at all is nothing to note.
    """
    kept = {name: value for name, value in given.items() if name not in _NO_EFFECT}
    return {PARAMETERS_KEY: json.dumps(kept, sort_keys=True)} if kept else {}


def contour_parameters(name_or_file: str) -> dict[str, object]:
    """Return the parameters that put an object in place, by name or from a YAML file.

    A file holds the fields of an object as in the node's parameter file, such as ``type: circle``,
    ``radius: 15 mm`` and ``clearance: 5 mm``; the object is then called as the file.
    """
    path = Path(name_or_file)
    if path.suffix not in (".yaml", ".yml"):
        return {"contour": name_or_file}
    shape = read_yaml(path)
    if not path.stem.isidentifier():
        raise InputError("its name must be of letters, digits and _", source=name_or_file)
    points = shape.get("points")
    if isinstance(points, list) and all(isinstance(point, list) for point in points):
        shape["points"] = [coordinate for point in points for coordinate in point]
    return {"contour": path.stem, **flat({"contours": {path.stem: shape}})}


def assignment(text: str) -> dict[str, object]:
    """Read ``KEY=VALUE``, the value as in YAML or a quantity such as ``4 mm``."""
    name, equals, value = text.partition("=")
    if not (name.strip() and equals and value.strip()):
        raise InputError(f"expected KEY=VALUE, got {text!r}", field="--set")
    try:
        read = float(value)
    except ValueError:
        try:
            read = load_yaml(value)
        except InputError as error:
            raise error.within(field_prefix=name.strip()) from None
    else:
        read = int(read) if value.strip().lstrip("+-").isdecimal() else read
    return {name.strip(): read}


def flat(nested: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    """Return nested mappings as one, the keys joined by dots."""
    content: dict[str, object] = {}
    for key, value in nested.items():
        name = f"{prefix}{key}"
        content |= flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return content


def _of_scene(settings: Settings) -> dict[str, object]:
    """Return the settings that a replay depends on: of the objects only the one in place."""
    own = f"contours.{settings.contour}."
    return {
        name: value
        for name, value in settings.values.items()
        if name not in _NO_EFFECT
        and not name.startswith("outline.")
        and (name.startswith(own) or not name.startswith("contours."))
    }
