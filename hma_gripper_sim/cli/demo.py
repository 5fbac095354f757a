"""``hma_gripper demo``."""

from __future__ import annotations

from pathlib import Path

import click

from hma_gripper_sim.cli.option_types import FILE


@click.command()
@click.option(
    "--report",
    type=FILE,
    default=Path("report"),
    show_default=True,
    help="Directory for the logs, plots, summary.md and report.json.",
)
@click.option(
    "--experiment",
    "experiments",
    type=FILE,
    multiple=True,
    metavar="FILE",
    help="Experiment to run (YAML); may be repeated. Default: the two of the thesis.",
)
@click.option(
    "--design",
    type=FILE,
    metavar="FILE",
    help="Gripper to simulate (YAML). Default: the one of the thesis.",
)
@click.option(
    "--real-time-factor",
    type=float,
    default=10.0,
    show_default=True,
    help="How many simulated seconds a second takes.",
)
@click.pass_context
def demo(
    ctx: click.Context,
    report: Path,
    experiments: tuple[Path, ...],
    design: Path | None,
    real_time_factor: float,
) -> None:
    """Pick up objects over ROS 2 and compare with the real gripper.

    Starts the simulation node as a process of its own, on a ROS domain of its own that stays on
    this machine. For each experiment it selects the object by service, moves the gripper onto it
    and back up, and logs what the node publishes. Then it reads the logs back and compares them
    with what was measured on the real gripper and with what the thesis published.

    \b
    Exit code: 0  every figure is inside its stated bound
               1  a figure is outside, or the node failed
               2  bad input: one line says which file, which field and why

    \b
    Examples:
      hma_gripper demo
      hma_gripper demo --report pick_up --real-time-factor 5
      hma_gripper demo --experiment my_box.yaml --design my_gripper.yaml
    """
    from hma_gripper_sim.demo.demo import run_demo

    ctx.exit(run_demo(report, experiments, design, real_time_factor))
