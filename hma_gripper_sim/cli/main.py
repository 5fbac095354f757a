"""The command line: ``hma_gripper``, a command whose sub-commands each live in their own module."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from hma_gripper_sim.cli.benchmark import benchmark
from hma_gripper_sim.cli.calibrate import calibrate
from hma_gripper_sim.cli.compare import compare
from hma_gripper_sim.cli.record import record
from hma_gripper_sim.cli.replay import replay
from hma_gripper_sim.cli.urdf import urdf
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.ros.node_process import NodeError


class _Commands(click.Group):
    """A group whose commands report failures in one line; bad input gives exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as error:
            click.echo(f"error: {error}", err=True)
            ctx.exit(2)
        except (NodeError, SimulationError, OSError) as error:
            click.echo(f"error: {error}", err=True)
            ctx.exit(1)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
def cli() -> None:
    """Simulate a passive compliant gripper, and compare it with real ones."""


@cli.command()
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    default=Path("report"),
    show_default=True,
    help="Directory for the logs, plots, summary.md and report.json.",
)
@click.option(
    "--experiment",
    "experiments",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Experiment to run (YAML); may be repeated. Default: the two of the thesis.",
)
@click.option(
    "--design",
    type=click.Path(path_type=Path),
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


cli.add_command(benchmark)
cli.add_command(calibrate)
cli.add_command(compare)
cli.add_command(record)
cli.add_command(replay)
cli.add_command(urdf)


def main() -> None:
    """Run the command line."""
    cli(prog_name="hma_gripper")


if __name__ == "__main__":
    main()
