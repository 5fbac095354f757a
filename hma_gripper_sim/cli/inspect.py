"""``hma_gripper inspect``."""

from __future__ import annotations

from pathlib import Path

import click

from hma_gripper_sim.cli.option_types import FILE


@click.command()
@click.argument("log", type=FILE)
@click.option(
    "--map",
    "map_file",
    type=FILE,
    metavar="FILE",
    help="Write the starter signal map here; the file must not exist yet.",
)
def inspect(log: Path, map_file: Path | None) -> None:
    """Say what is in a log, and propose a signal map to edit.

    Shown are the time span, the topics with their types, publishers, rates, joints, frames and
    fields, and what is damaged or cannot be read. The signal map holds where each signal may be,
    guessed from types and names: the likeliest place, and others as comments.

    \b
    Exit code: 0  read
               2  bad input: one line says which file and why

    \b
    Examples:
      hma_gripper inspect real.mcap
      hma_gripper inspect real.bag --map my_arm.yaml
    """
    from rich.console import Console

    from hma_gripper_sim.cli.compare import write_text
    from hma_gripper_sim.cli.printing import print_line, print_notes, print_tables
    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.recordings.inspection import (
        PUBLISHERS,
        heading,
        inspect_log,
        inspection_table,
    )
    from hma_gripper_sim.recordings.starter_map import starter_map

    if map_file is not None and map_file.exists():
        raise InputError("exists already", field="--map", source=str(map_file))
    found = inspect_log(log)
    text = starter_map(found)
    if map_file is not None:  # before anything is printed: a reader may close the pipe
        write_text(map_file, text)
    console = Console()
    print_line(console, heading(found))
    print_notes(console, found.notes)
    print_tables(console, [inspection_table(found)])
    print_line(console, f"{PUBLISHERS}.")
    if map_file is not None:
        print_line(console, f"wrote {map_file}")
    else:
        click.echo(text, nl=False)
