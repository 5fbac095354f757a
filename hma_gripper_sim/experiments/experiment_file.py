"""Reading experiments from YAML files such as those in ``config/experiments``.

A file holds ``title`` and ``source``; the ``scene`` (contour, clearance, friction, contact, and the
path of a ``design`` where it is not the thesis' gripper); the ``motion``, a list of velocities and
durations of which the first is the approach; what was ``measured``, at instants and with
uncertainties, and the ``max_error`` that each figure may have; and, where there is a publication,
the figures that were ``published`` with the error or the window that is allowed for each. Where
there is a ``log`` (its ``path``, a map of its ``signals``, and the ``uncertainty`` of a sample of
each), the motion may be left out. An experiment that is only planned has nothing measured. Paths
are relative to the file. Quantities are texts with units; bare numbers are SI.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import (
    Criterion,
    Experiment,
    ExperimentLog,
    Measurement,
    Segment,
)
from hma_gripper_sim.model.contours.shapes import contour_from_mapping
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.model.numbers import declared_numbers
from hma_gripper_sim.model.scene import CONTACTS, SceneDescription
from hma_gripper_sim.recordings.run_figures import FIGURES, Figure
from hma_gripper_sim.recordings.signal_map import SIGNAL_UNITS, SignalMap
from hma_gripper_sim.units import choice, quantity
from hma_gripper_sim.yaml_reading import config_directory, read_yaml, refuse_unknown

_MEASURABLE = ("phi_left", "phi_right", "actuator_force")
_ROUND_OFF = 1e-9
"""How far [m] rounding may take the sum of a motion's segments below the start pose."""


_LOG_SUFFIXES = (".mcap", ".db3", ".bag", ".zstd", ".active")
"""Of files that are logs."""


def _is_log(path: Path) -> bool:
    """Whether a path is by its name that of a log, or of a directory with one."""
    if path.is_dir():
        return any(entry.suffix in _LOG_SUFFIXES for entry in path.iterdir())
    return path.suffix in _LOG_SUFFIXES


def is_experiment(path: str | Path) -> bool:
    """Whether a path is that of an experiment file, or the name of a shipped one; not of a log."""
    return Path(path).suffix in (".yaml", ".yml") or _is_shipped(path)


def _is_shipped(path: str | Path) -> bool:
    """Whether a path is no path but the name of a shipped experiment."""
    name = Path(path).name
    return name == str(path) and not Path(path).exists() and _shipped_file(name).is_file()


def _shipped_file(name: str) -> Path:
    return config_directory() / "experiments" / f"{name}.yaml"


def read_experiment(path: str | Path) -> Experiment:
    """Read an experiment file; of a shipped one the name is enough, such as ``thesis_2013_box``.

    Raises
    ------
    InputError
        Names the file, the field and what is wrong with it.
    """
    if _is_shipped(path):
        path = _shipped_file(Path(path).name)
    if _is_log(Path(path)):
        raise InputError(
            "is a log: wanted is an experiment file (YAML), with a scene and 'log: {path: ...}', "
            "as docs/logs.md describes it",
            source=str(path),
        )
    try:
        return _experiment(Path(path), _Section(read_yaml(path), ""))
    except InputError as error:
        raise error.within(source=str(path)) from None


class _Section:
    """A mapping in the file, which knows its own dotted name."""

    def __init__(self, fields: object, path: str) -> None:
        if not isinstance(fields, dict):
            raise InputError(f"expected a mapping of fields, got {fields!r}", field=path)
        self.fields: dict[str, Any] = fields
        self.path = path

    def __contains__(self, key: str) -> bool:
        return key in self.fields

    def name(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key

    def only(self, *known: str) -> None:
        try:
            refuse_unknown(self.fields, known)
        except InputError as error:
            raise error.within(field_prefix=self.path) from None

    def value(self, key: str) -> Any:
        if key not in self.fields:
            raise InputError("is missing", field=self.name(key))
        return self.fields[key]

    def text(self, key: str) -> str:
        value = self.value(key)
        if not isinstance(value, str) or not value.strip():
            raise InputError(f"expected a text, got {value!r}", field=self.name(key))
        return value

    def quantity(self, key: str, unit: str, **bounds: Any) -> float:
        return quantity(self.value(key), unit, field=self.name(key), **bounds)

    def declared(self, key: str, owner: Any) -> float:
        return declared_numbers(owner)[key].check(self.value(key), self.name(key))

    def section(self, key: str) -> _Section:
        return _Section(self.value(key), self.name(key))

    def sections(self, key: str) -> Iterator[_Section]:
        for index, entry in enumerate(self.list(key)):
            yield _Section(entry, f"{self.name(key)}[{index}]")

    def list(self, key: str) -> list[Any]:
        value = self.value(key)
        if not isinstance(value, list) or not value:
            raise InputError(f"expected a list, got {value!r}", field=self.name(key))
        return value


def _experiment(path: Path, file: _Section) -> Experiment:
    file.only("title", "source", "scene", "motion", "measured", "published", "log")
    scene = file.section("scene")
    scene.only("contour", "clearance", "friction", "contact", "design")
    contour = scene.section("contour")
    shape = {key: value for key, value in contour.fields.items() if key != "name"}
    log = _log(path, file.section("log")) if "log" in file else None
    motion = () if log and "motion" not in file else _motion(file)
    if log and not motion:
        for key in ("measured", "published"):
            if key in file:
                reason = "needs a motion, whose start is the time 0 of the instants"
                raise InputError(reason, field=key)
    end = sum(segment.duration for segment in motion)
    measurements: tuple[Measurement, ...] = ()
    measured: tuple[Criterion, ...] = ()
    if "measured" in file:
        section = file.section("measured")
        section.only("source", "instants", "max_error")
        measurements = tuple(_measurements(section, end))
        measured = tuple(_measured(section, measurements))
    design_file = str(path.parent / scene.text("design")) if "design" in scene else None
    return Experiment(
        name=path.stem,
        title=file.text("title"),
        source=file.text("source"),
        contour_name=_name(contour),
        contour=contour_from_mapping(shape, field=contour.path),
        clearance=scene.declared("clearance", SceneDescription),
        friction=scene.declared("friction", SceneDescription),
        contact=choice(scene.value("contact"), CONTACTS, field=scene.name("contact")),
        design=GripperDesign.from_yaml(design_file) if design_file else GripperDesign.thesis_2013(),
        design_file=design_file,
        motion=motion,
        measurements=measurements,
        measured=measured,
        published=tuple(_published(file, motion[0].duration, end) if "published" in file else ()),
        log=log,
    )


def _log(path: Path, section: _Section) -> ExperimentLog:
    section.only("path", "signals", "uncertainty")
    signal_map = None
    if "signals" in section:
        given = section.value("signals")
        if isinstance(given, dict):
            signal_map = SignalMap.from_mapping(
                given, field=section.name("signals"), folder=path.parent
            )
        else:
            signal_map = SignalMap.from_yaml(path.parent / section.text("signals"))
    uncertainties: dict[str, float] = {}
    if "uncertainty" in section:
        stated = section.section("uncertainty")
        stated.only(*SIGNAL_UNITS)
        uncertainties = {
            name: stated.quantity(name, SIGNAL_UNITS[name], minimum=0.0, exclusive=True)
            for name in stated.fields
        }
    return ExperimentLog(path.parent / section.text("path"), signal_map, uncertainties)


def _name(contour: _Section) -> str:
    name = contour.text("name")
    if not name.isidentifier():  # it becomes part of a ROS service's name
        raise InputError(
            f"must be of letters, digits and _, got {name!r}", field=contour.name("name")
        )
    return name


def _motion(file: _Section) -> tuple[Segment, ...]:
    segments: list[Segment] = []
    travel = 0.0
    for entry in file.sections("motion"):
        entry.only("velocity", "duration")
        velocity = entry.quantity("velocity", "m/s")
        duration = entry.quantity("duration", "s", minimum=0.0, exclusive=True)
        if not segments and velocity <= 0.0:
            raise InputError(
                "the first segment must move towards the object", field=entry.name("velocity")
            )
        travel += velocity * duration
        if travel < -_ROUND_OFF:
            raise InputError("ends above the start pose", field=entry.path)
        segments.append(Segment(velocity, duration))
    return tuple(segments)


def _measurements(measured: _Section, end: float) -> Iterator[Measurement]:
    for instant in measured.sections("instants"):
        instant.only("time", *_MEASURABLE)
        time = instant.quantity("time", "s", minimum=0.0, maximum=end)
        for name in _MEASURABLE:
            if name in instant:
                entry = instant.section(name)
                entry.only("value", "uncertainty")
                unit = FIGURES[name].unit
                value = _figure_value(entry, "value", FIGURES[name])
                uncertainty = entry.quantity("uncertainty", unit, minimum=0.0)
                yield Measurement(name, time, value, uncertainty)


def _measured(section: _Section, measurements: tuple[Measurement, ...]) -> Iterator[Criterion]:
    """Yield the measurements, and at each instant the mean of φ left and right (Table 5.3)."""
    source = section.text("source")
    bounds = section.section("max_error") if "max_error" in section else _Section({}, "")
    bounds.only("phi_mean", *_MEASURABLE)
    for time in dict.fromkeys(measurement.time for measurement in measurements):
        values = {m.figure: m.value for m in measurements if m.time == time}
        if "phi_left" in values and "phi_right" in values:
            values["phi_mean"] = 0.5 * (values["phi_left"] + values["phi_right"])
        for figure, value in values.items():
            margin = _margin(bounds, figure, value) if figure in bounds else math.inf
            yield Criterion(figure, time, value, value - margin, value + margin, source)


def _published(file: _Section, approach: float, end: float) -> Iterator[Criterion]:
    for entry in file.sections("published"):
        entry.only("figure", "time", "value", "max_error", "between", "source")
        name = choice(entry.value("figure"), tuple(FIGURES), field=entry.name("figure"))
        figure = FIGURES[name]
        time = approach
        if figure.timed:
            time = entry.quantity("time", "s", minimum=0.0, maximum=end)
        elif "time" in entry:
            raise InputError(f"{name} is of the whole approach", field=entry.name("time"))
        source = entry.text("source")
        if "between" in entry:
            if "value" in entry or "max_error" in entry:
                raise InputError(
                    "give either this or value and max_error", field=entry.name("between")
                )
            lower, upper = _window(entry, figure)
            yield Criterion(name, time, None, lower, upper, source)
        else:
            value = _figure_value(entry, "value", figure)
            margin = _margin(entry, "max_error", value)
            yield Criterion(name, time, value, value - margin, value + margin, source)


def _margin(section: _Section, key: str, value: float) -> float:
    if value == 0.0:
        raise InputError(
            "a relative error has no meaning for a value of 0", field=section.name(key)
        )
    return abs(value) * section.quantity(key, "", minimum=0.0)


def _window(entry: _Section, figure: Figure) -> tuple[float, float]:
    ends = entry.list("between")
    field = entry.name("between")
    if len(ends) != 2:
        raise InputError(f"expected two ends, got {ends!r}", field=field)
    lower, upper = (quantity(end, figure.unit, field=field) for end in ends)
    if lower >= upper:
        raise InputError(f"the first end must be the lower one, got {ends!r}", field=field)
    return lower, upper


def _figure_value(entry: _Section, key: str, figure: Figure) -> float:
    if figure.unit == "rad":  # keeps out degrees that were given as a bare number
        return entry.quantity(key, figure.unit, minimum=0.0, maximum=math.pi)
    return entry.quantity(key, figure.unit)
