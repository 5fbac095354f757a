"""``hma_gripper demo``: pick-ups over ROS 2, logged, and compared with the real gripper."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from hma_gripper_sim import config_directory
from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.comparison.experiment_criteria import align, compare
from hma_gripper_sim.comparison.report import Result, terminal_table, write_report
from hma_gripper_sim.device.topics import LOGGED_TOPICS, NODE
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.experiments.node_parameters import node_parameters
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.recordings.reading import read_poses, read_recording
from hma_gripper_sim.replay.log_verification import verify_log
from hma_gripper_sim.replay.simulated_settings import flat, metadata
from hma_gripper_sim.ros.node_process import NodeProcess, private_ros_domain, ros_is_missing
from hma_gripper_sim.units import quantity

if TYPE_CHECKING:
    from hma_gripper_sim.ros.client.demo_client import DemoClient

SHIPPED = ("thesis_2013_box.yaml", "thesis_2013_cylinder.yaml")
"""Experiments that come with the package, in ``config/experiments``."""

_START_TIMEOUT = 180.0
"""How long [s] the node may take to publish: its first start on a machine compiles the solver."""

_COMMAND_TIMEOUT = 0.5
"""How long the node waits for the next command before it stops the gripper, in real time [s]."""

_SNAPSHOTS = 8
"""Panels of the snapshot series."""


def run_demo(
    report: Path,
    experiment_files: Sequence[Path],
    design_file: Path | None,
    real_time_factor: float,
) -> int:
    """Run experiments over ROS, write the report, and print the comparison.

    Parameters
    ----------
    report
        Directory to write to; what an earlier demo left there is replaced.
    experiment_files
        Empty: the shipped ones.
    design_file
        None: the gripper of the thesis.
    real_time_factor
        Simulated seconds per second.

    Returns
    -------
    int
        0 if every figure is inside its stated bound, otherwise 1.

    Raises
    ------
    InputError
        Something given cannot be used, or ROS 2 is missing.
    NodeError
        The node failed.
    """
    factor = quantity(
        real_time_factor,
        "",
        field="--real-time-factor",
        minimum=0.0,
        maximum=1000.0,
        exclusive=True,
    )
    files = experiment_files or [config_directory() / "experiments" / name for name in SHIPPED]
    experiments = [read_experiment(file) for file in files]
    _check_common(files, experiments, design_file)
    design = GripperDesign.from_yaml(design_file) if design_file else experiments[0].design
    client_type = _ros_client()
    _prepare(report, experiments)
    parameters = _parameters(experiments, design_file, factor)
    console = Console()
    with _progress(console) as progress:
        _record(report, experiments, parameters, client_type, progress)
        evaluating = progress.add_task("evaluating the logs", total=len(experiments))
        results = []
        for experiment in experiments:
            results.append(_evaluate(report, experiment, design))
            progress.advance(evaluating)
    write_report(report, results)
    for result in results:
        console.print(terminal_table(result.experiment.title, result.comparisons))
        for remark in result.remarks:
            console.print(remark, markup=False, highlight=False, soft_wrap=True)
    passed = all(result.passed for result in results)
    verdict = "every figure is inside its bound" if passed else "figures are outside their bounds"
    console.print(f"{verdict}; report: {report / 'summary.md'}", soft_wrap=True)
    return 0 if passed else 1


def _check_common(
    files: Sequence[Path], experiments: Sequence[Experiment], design_file: Path | None
) -> None:
    """Raise `InputError` if one node and one report cannot serve all experiments."""
    by_name: dict[str, Experiment] = {}
    by_contour: dict[str, Experiment] = {}
    for file, experiment in zip(files, experiments, strict=True):
        if by_name.setdefault(experiment.name, experiment) is not experiment:
            reason = f"there is another experiment named {experiment.name}"
            raise InputError(reason, field="--experiment", source=str(file))
        if not experiment.motion:
            reason = "is missing: only a log says how the gripper moved"
            raise InputError(reason, field="motion", source=str(file))
        for field in ("friction", "contact", *(() if design_file else ("design",))):
            if getattr(experiment, field) != getattr(experiments[0], field):
                reason = f"differs from that of {experiments[0].name}: run the demo once for each"
                raise InputError(reason, field=f"scene.{field}", source=str(file))
        other = by_contour.setdefault(experiment.contour_name, experiment)
        if (other.contour, other.clearance) != (experiment.contour, experiment.clearance):
            reason = f"{experiment.contour_name!r} is another object in {other.name}"
            raise InputError(reason, field="scene.contour.name", source=str(file))


def _ros_client() -> type[DemoClient]:
    """Import the ROS side; done early because wheels of rclpy then start the program anew."""
    try:
        from hma_gripper_sim.ros.client.demo_client import DemoClient
    except ImportError as error:
        raise InputError(ros_is_missing(error)) from None
    return DemoClient


def _prepare(report: Path, experiments: Sequence[Experiment]) -> None:
    """Make the report's directories, and remove the logs of an earlier demo."""
    try:
        for experiment in experiments:
            log = _log_path(report, experiment)
            log.parent.mkdir(parents=True, exist_ok=True)
            if log.exists():
                (log / "metadata.yaml").unlink(missing_ok=True)
                (log / f"{log.name}.mcap").unlink(missing_ok=True)
                log.rmdir()
    except OSError as error:
        raise InputError(
            f"cannot be prepared: {error.strerror}", field="--report", source=str(error.filename)
        ) from None


def _log_path(report: Path, experiment: Experiment) -> Path:
    return report / experiment.name / "log"


def _parameters(
    experiments: Sequence[Experiment], design_file: Path | None, factor: float
) -> dict[str, Any]:
    """Return what the node is to simulate, as its parameters."""
    content = {
        **node_parameters(experiments),
        "real_time_factor": factor,
        # Counted in simulated time: the patience in real time stays the same at any factor.
        "command_timeout": _COMMAND_TIMEOUT * max(1.0, factor),
    }
    if design_file:
        content["design"] = str(design_file.resolve())
    return content


def _record(
    report: Path,
    experiments: Sequence[Experiment],
    parameters: dict[str, Any],
    client_type: type[DemoClient],
    progress: Progress,
) -> None:
    """Start the node, run every experiment on it, log what it publishes, and end it."""
    file = report / "sim_node.yaml"
    text = yaml.safe_dump({NODE: {"ros__parameters": parameters}}, sort_keys=False)
    file.write_text(text, encoding="utf-8")
    with (
        _terminable(),
        private_ros_domain(),
        NodeProcess(file, report / "sim_node.log") as node,
    ):
        starting = progress.add_task("starting sim_node", total=None)
        with client_type(node) as client:
            client.wait_for_node(_START_TIMEOUT)
            progress.update(starting, total=1, completed=1)
            for experiment in experiments:
                log = LogWriter(
                    _log_path(report, experiment),
                    LOGGED_TOPICS,
                    custom_data=_metadata(parameters, experiment),
                )
                _pick_up(log, experiment, client, progress)
        node.stop()


def _metadata(parameters: dict[str, Any], experiment: Experiment) -> dict[str, str]:
    """Return what is simulated in one experiment, for its log to say: a replay needs no more."""
    return metadata(flat({**parameters, "contour": experiment.contour_name}))


def _pick_up(
    log: LogWriter, experiment: Experiment, client: DemoClient, progress: Progress
) -> None:
    duration = experiment.way_points[-1][0]
    task = progress.add_task(f"picking up the {experiment.contour_name}", total=duration)
    client.select(experiment.contour_name)
    with log:
        client.follow(experiment.motion, log, lambda time: progress.update(task, completed=time))
    progress.update(task, completed=duration)


def _evaluate(report: Path, experiment: Experiment, design: GripperDesign) -> Result:
    """Read an experiment's log back, compare it, and draw its pictures."""
    from hma_gripper_sim.comparison import run_plots  # matplotlib is slow to import

    log = _log_path(report, experiment)
    recording = read_recording(log)
    run = align(recording, experiment, design)
    scene = experiment.scene(design)
    times = np.linspace(0.0, experiment.approach, _SNAPSHOTS).tolist()
    stamps = [run.recording.start + round(1e9 * time) for time in times]
    poses = read_poses(log, stamps, scene.joint_names)
    force, phi, snapshots = (
        log.parent / f"{name}.png" for name in ("actuator_force", "phi", "snapshots")
    )
    run_plots.plot_force(force, run, experiment)
    run_plots.plot_phi(phi, run, experiment)
    run_plots.plot_snapshots(snapshots, scene, times, poses)
    remarks = verify_log(log, recording)
    return Result(experiment, compare(run, experiment), log, (force, phi, snapshots), remarks)


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=console,
    )


@contextmanager
def _terminable() -> Iterator[None]:
    """Make SIGTERM and SIGHUP unwind the stack, so that child processes are ended."""

    def unwind(number: int, _: object) -> None:
        raise SystemExit(128 + number)

    signals = (signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, unwind) for number in signals]
    try:
        yield
    finally:
        for number, handler in zip(signals, before, strict=True):
            signal.signal(number, handler)
