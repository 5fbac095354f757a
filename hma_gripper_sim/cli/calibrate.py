"""``hma_gripper calibrate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hma_gripper_sim.cli.option_types import FILE
from hma_gripper_sim.cli.replay import travel_tolerance_option

if TYPE_CHECKING:
    from hma_gripper_sim.calibration.fitting import Calibration
    from hma_gripper_sim.experiments.experiment import Experiment, ExperimentLog


@click.command()
@click.argument("experiment", type=FILE)
@click.option(
    "--free",
    required=True,
    metavar="NAME,...",
    help="What to find: friction (mu), clearance, offset, normal_stiffness, normal_damping, "
    "youngs_modulus (E), density (rho), width, height, top_length, beam_length, beam_angle, "
    "joint_damping; and, of how the log came about, force_delay, angle_delay, force_bias, "
    "angle_bias.",
)
@click.option(
    "--bound",
    "bounds",
    multiple=True,
    metavar="NAME=LOW..HIGH",
    help="Where to look for it, such as E=5MPa..12MPa; may be repeated.",
)
@travel_tolerance_option
@click.option("--json", "json_file", type=FILE, help="Write the result here.")
@click.pass_context
def calibrate(
    ctx: click.Context,
    experiment: Path,
    free: str,
    bounds: tuple[str, ...],
    travel_tolerance: float,
    json_file: Path | None,
) -> None:
    """Find the parameters with which the simulation follows an experiment best.

    Least squares on the force and both angles of the experiment's log, along its measured travel;
    of an experiment without a log on what was measured at instants. The search starts from the
    values in the experiment's file and its design.

    Standard errors are what noise of the size of the remaining differences does to the result;
    samples whose errors are correlated count as fewer. That the model itself may be wrong is not
    in them.

    \b
    Exit code: 0  found
               1  the search did not converge, or the scene cannot be simulated
               2  bad input, or an experiment that cannot tell what is asked for: one line says
                  which file, which field and why

    \b
    Examples:
      hma_gripper calibrate my_cup.yaml --free friction
      hma_gripper calibrate my_cup.yaml --free friction,E --bound E=5MPa..12MPa --json found.json
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.experiments.experiment_file import read_experiment

    console, errors = Console(), Console(stderr=True)
    read = read_experiment(experiment)
    with errors.status("reading"):  # before the solver is loaded: what is wrong is said at once
        if read.log:
            _refuse_unknown_zero(read.log, free)

    from hma_gripper_sim.calibration.fitting import calibrate
    from hma_gripper_sim.calibration.free_parameters import free_parameters
    from hma_gripper_sim.calibration.observations import trial
    from hma_gripper_sim.calibration.tables import remarks, terminal_tables
    from hma_gripper_sim.cli.compare import write_text
    from hma_gripper_sim.cli.printing import print_notes, print_tables
    from hma_gripper_sim.comparison.result_text import json_text

    scene = read.scene()
    wanted = free_parameters(free, scene, bounds)
    # How many simulations it will take is not known: the bar shows that it goes on.
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(
        *columns, console=errors, transient=True, disable=not errors.is_terminal
    ) as progress:
        task = progress.add_task("simulating", total=None)
        measured = trial(read, str(experiment), travel_tolerance)
        print_notes(console, measured.notes)
        result = calibrate(
            scene,
            measured,
            wanted,
            lambda count, error: progress.update(
                task, description=f"{count} simulations, weighted RMS error {error:.4g}"
            ),
        )
    print_tables(console, terminal_tables(result))
    print_notes(console, remarks(result))
    if json_file:
        write_text(json_file, json_text(_as_json(experiment, read, result)))
    if result.untold:
        raise InputError(
            f"the experiment cannot tell {' and '.join(result.untold)}: the standard error is "
            "comparable with the room between the bounds; leave out what it does not show, or "
            "record a log that begins before the touch",
            field="--free",
            source=str(experiment),
        )
    ctx.exit(0 if result.converged else 1)


def _refuse_unknown_zero(log: ExperimentLog, free: str) -> None:
    """Refuse a log that does not tell where its travel is 0, unless the clearance is free."""
    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.recordings.plausibility import has_known_zero

    recording = log.recording
    if "clearance" not in free and not has_known_zero(recording, log.signal_map):
        raise InputError(
            "its tare was taken in motion throughout: where it is 0, and with it the clearance, is "
            "not known; record a log that begins at rest before the touch, give an 'offset' for "
            "the 'tare', or free clearance as well",
            field="travel",
            source=recording.source,
        )


def _as_json(path: Path, experiment: Experiment, result: Calibration) -> dict[str, Any]:
    """Return what was found, and from where the search started."""
    from hma_gripper_sim.calibration.tables import as_json
    from hma_gripper_sim.comparison.provenance import program_version, simulation_facts
    from hma_gripper_sim.experiments.node_parameters import node_parameters
    from hma_gripper_sim.replay.simulated_settings import flat

    return {
        "experiment": str(path),
        "start": dict(simulation_facts(flat(node_parameters([experiment])))),
        "version": program_version(),
        **as_json(result),
    }
