"""The command line: ``hma_gripper``, a command whose sub-commands each live in their own module."""

from __future__ import annotations

from typing import Any

import click

from hma_gripper_sim.cli.benchmark import benchmark
from hma_gripper_sim.cli.calibrate import calibrate
from hma_gripper_sim.cli.compare import compare
from hma_gripper_sim.cli.demo import demo
from hma_gripper_sim.cli.inspect import inspect
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


for command in (benchmark, calibrate, compare, demo, inspect, record, replay, urdf):
    cli.add_command(command)


def main() -> None:
    """Run the command line."""
    cli(prog_name="hma_gripper")


if __name__ == "__main__":
    main()
