"""``hma_gripper compare``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hma_gripper_sim.cli.option_types import FILE, Quantity

if TYPE_CHECKING:
    from hma_gripper_sim.comparison.log_comparison import LogComparison


max_error_option = click.option(
    "--max-error",
    "max_errors",
    multiple=True,
    metavar="SIGNAL=LIMIT",
    help="Exit with 1 if the error is larger anywhere; may be repeated. LIMIT is relative, such "
    "as 2%, or has a unit. SIGNAL: travel, actuator_force (force), phi (the mean of both sides), "
    "phi_left, phi_right, bending_moment.",
)
min_coverage_option = click.option(
    "--min-coverage",
    "least_coverage",
    type=Quantity("", minimum=0.0, maximum=1.0),
    default="95%",
    show_default=True,
    metavar="SHARE",
    help="How much of the measured signal a simulated one has to cover for a bound on it to be "
    "kept. No gap may be longer than a fifth of what need not be covered.",
)
json_option = click.option("--json", "json_file", type=FILE, help="Write the comparison here.")
html_option = click.option(
    "--html",
    "html_file",
    type=FILE,
    help="Write the comparison here as one self-contained page with plots.",
)


@click.command()
@click.argument("simulated", metavar="SIM", type=FILE)
@click.argument("experiment", type=FILE)
@click.option(
    "--signals",
    "signal_map",
    type=FILE,
    metavar="MAP",
    help="Signal map of EXPERIMENT, if that is a log (YAML). Default: as the node publishes.",
)
@click.option(
    "--sim-signals",
    "simulated_map",
    type=FILE,
    metavar="MAP",
    help="Signal map of SIM (YAML), if its node had a prefix or a namespace. Default: as the node "
    "publishes without them.",
)
@click.option(
    "--align",
    type=click.Choice(["auto", "stamps", "travel"]),
    default="auto",
    show_default=True,
    help="How to match the time of two logs; auto: by the stamps where the logs overlap by them, "
    "otherwise by the offset that makes the travels differ least.",
)
@click.option(
    "--at",
    "instants",
    type=Quantity("s"),
    multiple=True,
    metavar="TIME",
    help="Also report the signals at this time of the experiment's log; may be repeated.",
)
@max_error_option
@min_coverage_option
@json_option
@html_option
@click.pass_context
def compare(
    ctx: click.Context,
    simulated: Path,
    experiment: Path,
    signal_map: Path | None,
    simulated_map: Path | None,
    align: str,
    instants: tuple[float, ...],
    max_errors: tuple[str, ...],
    least_coverage: float,
    json_file: Path | None,
    html_file: Path | None,
) -> None:
    """Compare a simulated log with an experiment, or with another log.

    SIM is a log of the node or of `hma_gripper replay`. EXPERIMENT is an experiment file (YAML), a
    name of a shipped one such as thesis_2013_box, or a log.

    For each signal that both have: RMSE, largest error, bias and relative error, over all of it
    and over the phases approach, enveloping, hold and lift; left, right and their mean. Where
    angles were measured at instants: a row of the thesis' Table 5.3.

    \b
    Exit code: 0  every bound is kept, those in the experiment file and those of --max-error
               1  a bound is not kept, or not enough is covered to judge by
               2  bad input: one line says which file, which field and why

    \b
    Examples:
      hma_gripper compare sim/box thesis_2013_box
      hma_gripper compare sim real.mcap --signals my_arm.yaml --html report.html
      hma_gripper compare new old --max-error phi=0.1% --max-error force=5mN
    """
    from hma_gripper_sim.comparison.bounds import read_bound
    from hma_gripper_sim.comparison.log_comparison import compare_files

    result = compare_files(
        simulated,
        experiment,
        simulated_map=simulated_map,
        signal_map=signal_map,
        method=align,
        instants=instants,
        bounds=[read_bound(text) for text in max_errors],
        least_coverage=least_coverage,
    )
    show(result)
    write(result, json_file, html_file)
    ctx.exit(0 if result.passed else 1)


def show(result: LogComparison) -> None:
    """Print a comparison."""
    from rich.console import Console

    from hma_gripper_sim.cli.printing import print_line, print_notes, print_tables
    from hma_gripper_sim.comparison.tables import terminal_tables

    console = Console()
    print_notes(console, result.notes)
    print_line(console, f"{result.alignment}.")
    print_tables(console, terminal_tables(result))


def write(result: LogComparison, json_file: Path | None, html_file: Path | None) -> None:
    """Write a comparison to the files that are asked for."""
    if json_file:
        from hma_gripper_sim.comparison.result_text import json_text
        from hma_gripper_sim.comparison.tables import as_json

        write_text(json_file, json_text(as_json(result)))
    if html_file:
        from hma_gripper_sim.comparison.html_page import html_page  # matplotlib is slow to import

        write_text(html_file, html_page(result))


def write_text(path: Path, text: str) -> None:
    """Write a file; raise `InputError` if that cannot be done."""
    from hma_gripper_sim.errors import InputError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", source=str(path)) from None
