"""``hma_gripper record``."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import click

from hma_gripper_sim.cli.option_types import FILE, Quantity


@click.command()
@click.argument("out", type=FILE, required=False)
@click.option(
    "--node",
    default="/hma_gripper_sim",
    show_default=True,
    metavar="NAME",
    help="Full name of the simulation node, with its namespace.",
)
@click.option(
    "--duration",
    type=Quantity("s", minimum=0.0),
    metavar="TIME",
    help="How long, by the stamps. Default: until Ctrl-C.",
)
@click.option(
    "--timeout",
    type=Quantity("s", minimum=0.0),
    default="10 s",
    show_default=True,
    metavar="TIME",
    help="How long to wait for the node.",
)
def record(out: Path | None, node: str, duration: float | None, timeout: float) -> None:
    """Record what a running node takes and publishes, until Ctrl-C.

    OUT is the rosbag2 directory to create, with an mcap file; by default it is named after the
    time. Every message has the stamp of the tick that it belongs to, so the log is in simulated
    time, and it can be read even if this program is killed.

    \b
    Exit code: 0  recorded; one line says what
               1  the node is not there, or ROS 2 is missing
               2  bad input: one line says which file, which field and why

    \b
    Examples:
      hma_gripper record
      hma_gripper record box_1 --duration 10s
      hma_gripper record left --node /left/hma_gripper_sim
    """
    from rich.console import Console

    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.ros.node_process import NodeError, ros_is_missing

    if not node.startswith("/") or node.endswith("/"):
        raise InputError(
            f"must be a full name such as /hma_gripper_sim, got {node!r}", field="--node"
        )
    path = out or Path(datetime.now().strftime("hma_gripper_%Y-%m-%d_%H-%M-%S"))
    if path.exists():
        raise InputError("exists already", source=str(path))
    try:
        from hma_gripper_sim.ros.recording import session
    except ImportError as error:
        raise NodeError(ros_is_missing(error)) from None
    console = Console()
    with console.status(f"waiting for {node}") as status:
        summary = session.record(
            path,
            node,
            duration,
            timeout,
            lambda s: status.update(
                f"recording to {path}: {s.duration:.1f} s, {s.ticks} ticks; Ctrl-C ends it"
            ),
        )
    console.print(
        f"recorded {path}: {summary.duration:.3f} s, {summary.ticks} ticks, "
        f"{summary.messages} messages ({summary.ending})",
        soft_wrap=True,
        highlight=False,
    )
