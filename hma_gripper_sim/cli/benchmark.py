"""``hma_gripper benchmark``."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.option(
    "--quick/--full",
    default=True,
    show_default="quick",
    help="A part in one or two minutes, or everything in about an hour.",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("benchmark"),
    show_default=True,
    help="Directory for benchmarks.md, benchmarks.json and the plots.",
)
def benchmark(quick: bool, out: Path) -> None:
    """Measure speed against error, beside other simulators.

    Simulates the thesis' scenes, a hold, a reversal and a cantilever with a sweep of tolerances and
    resolutions, on one core, beside MuJoCo, Exudyn and scipy where they are installed
    (pip install 'hma_gripper_sim[bench]'). Every result is checked against its reference before its
    speed counts. The full run adds tighter references, more rounds, the time of a first
    compilation, the convergence studies and all hard cases.

    Then scenes nobody chose: is the error that is asked for the error that is got? Objects,
    grippers, contacts and motions are drawn from seeds 0, 1, 2, ... and each run is compared with
    one at a tolerance at least 30 times tighter, in two processes. The full run draws 300 scenes
    of all kinds, 300 natural picks and 200 that ask for an accuracy; it checks the reference
    against independent equations on 30 of them, and compares with MuJoCo, at MuJoCo's own error,
    on 60.

    \b
    Examples:
      hma_gripper benchmark
      hma_gripper benchmark --full --out docs
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from hma_gripper_benchmarks import peers, reporting, running

    console = Console()
    for name, (distribution, _) in peers.PEERS.items():
        if peers.installed_version(name) is None:
            console.print(f"{name} is not installed and skipped: pip install {distribution}")
    columns = (
        TextColumn("[progress.description]{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("starting", total=EXPECTED[not quick])
        results = running.run(
            not quick, lambda text: progress.update(bar, description=text[:60], advance=1)
        )
    for table in reporting.terminal_tables(results):
        console.print(table)
    for path in reporting.write(out, results):
        console.print(f"wrote {path}", highlight=False)
    console.print(reporting.summary(results))


# Reports of progress that a run gives, roughly, in quick and in full mode.
EXPECTED = {False: 325, True: 3140}
