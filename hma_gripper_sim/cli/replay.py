"""``hma_gripper replay``."""

from __future__ import annotations

from pathlib import Path

import click

from hma_gripper_sim.cli.compare import (
    html_option,
    json_option,
    max_error_option,
    min_coverage_option,
)
from hma_gripper_sim.cli.option_types import FILE, Quantity

travel_tolerance_option = click.option(
    "--travel-tolerance",
    type=Quantity("m", minimum=0.0, exclusive=True),
    default="1 um",
    show_default=True,
    metavar="LENGTH",
    help="How far the simulated travel may be from the measured one; more smooths an encoder's "
    "noise.",
)


@click.command()
@click.argument("log", type=FILE)
@click.option(
    "--output",
    type=FILE,
    required=True,
    metavar="DIR",
    help="The log to write: a rosbag2 directory with an mcap file. It must not exist yet.",
)
@click.option(
    "--from",
    "basis",
    type=click.Choice(["commands", "travel"]),
    help="Follow the commanded velocity, through the node's own drive, or the measured travel. "
    "Default: the commands if LOG has them.",
)
@click.option(
    "--signals",
    "signal_map",
    type=FILE,
    metavar="MAP",
    help="Signal map of LOG (YAML). Default: as the node publishes.",
)
@click.option(
    "--contour",
    metavar="NAME|FILE",
    help="Object to press on: one of the node's catalogue, or a YAML file of its fields.",
)
@click.option(
    "--design", metavar="FILE", help="Gripper (YAML). Default: as logged, or the one of the thesis."
)
@click.option("--friction", metavar="MU", help="Coefficient of friction.")
@click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="KEY=VALUE",
    help="Any other parameter of the node (config/sim_node.yaml), clearance or offset of the "
    "object, accuracy, gravity; such as clearance=4mm. May be repeated.",
)
@click.option(
    "--rate",
    type=Quantity("Hz", minimum=0.0, exclusive=True),
    metavar="HZ",
    help="Samples per second in the log. Default: every tick, or every nth for at most 100 Hz.",
)
@travel_tolerance_option
@max_error_option
@min_coverage_option
@json_option
@html_option
@click.pass_context
def replay(
    ctx: click.Context,
    log: Path,
    output: Path,
    basis: str | None,
    signal_map: Path | None,
    contour: str | None,
    design: str | None,
    friction: str | None,
    assignments: tuple[str, ...],
    rate: float | None,
    travel_tolerance: float,
    max_errors: tuple[str, ...],
    least_coverage: float,
    json_file: Path | None,
    html_file: Path | None,
) -> None:
    """Simulate what was done to a gripper in a log, offline, and compare.

    LOG is a log of the node, of a real gripper, an experiment file (YAML), or the name of a
    shipped experiment such as thesis_2013_box. What is simulated is taken from it where it says
    so, and from the options. The result has the node's topics and types, the same stamps as LOG,
    and is the same every time, byte for byte.

    \b
    Exit code: 0  every bound is kept, those in the experiment file and those of --max-error
               1  a bound is not kept, or the simulation could not go on
               2  bad input: one line says which file, which field and why

    \b
    Examples:
      hma_gripper replay thesis_2013_box --output sim/box
      hma_gripper replay report/thesis_2013_box/log --output again --max-error phi=0.5%
      hma_gripper replay real.mcap --signals my_arm.yaml --contour cup.yaml --friction 0.8 \\
        --from travel --output sim/cup --html cup.html
    """
    from hma_gripper_sim.cli.compare import show, write
    from hma_gripper_sim.comparison.bounds import read_bound
    from hma_gripper_sim.replay.source import read_source

    experiment, recording = read_source(log, signal_map)
    from hma_gripper_sim.replay.session import Request, carry_out
    from hma_gripper_sim.replay.simulated_settings import assignment, contour_parameters

    options: dict[str, object] = contour_parameters(contour) if contour else {}
    options |= {"design": design} if design else {}
    options |= assignment(f"friction={friction}") if friction else {}
    for text in assignments:
        options |= assignment(text)
    request = Request(
        source=log,
        output=output,
        experiment=experiment,
        recording=recording,
        basis=basis,
        signal_map=signal_map,
        options=options,
        rate=rate,
        travel_tolerance=travel_tolerance,
        bounds=[read_bound(text) for text in max_errors],
        least_coverage=least_coverage,
    )
    result = carry_out(request)
    if result is not None:
        show(result)
        write(result, json_file, html_file)
        ctx.exit(0 if result.passed else 1)
