"""``hma_gripper urdf``."""

from __future__ import annotations

from pathlib import Path

import click

from hma_gripper_sim.cli.option_types import FILE
from hma_gripper_sim.errors import InputError


@click.command()
@click.option(
    "--params-file",
    type=FILE,
    metavar="FILE",
    help="Parameter file (YAML) that the node is started with: design, elements, limits.",
)
@click.option(
    "--node",
    default="hma_gripper_sim",
    show_default=True,
    metavar="NAME",
    help="Name of the node, by which that file calls it.",
)
@click.option(
    "--design",
    type=FILE,
    metavar="FILE",
    help="Gripper (YAML). Default: the one of the thesis.",
)
@click.option(
    "--discretisation",
    metavar="thesis|midpoint",
    help="How the node divides the gripper into elements. Default: thesis.",
)
@click.option("--elements-top", type=int, metavar="N", help="Elements of half the top beam.")
@click.option("--elements-beam", type=int, metavar="N", help="Elements of a side beam.")
@click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="KEY=VALUE",
    help="Any other parameter of the node, as it was told to the node.",
)
@click.option(
    "--prefix",
    metavar="TEXT",
    help="Stands before all names, as the node's parameter. Default: that of the file, or none.",
)
@click.option(
    "--parent",
    metavar="LINK",
    help="Link that carries the gripper, such as an arm's flange. Default: none.",
)
@click.option(
    "--arm",
    type=FILE,
    metavar="FILE",
    help="Arm (URDF) with that link: print one description of both.",
)
@click.option("--xyz", type=float, nargs=3, default=(0.0, 0.0, 0.0), help="Place on that link [m].")
@click.option(
    "--rpy",
    type=float,
    nargs=3,
    default=(0.0, 0.0, 0.0),
    help="Roll, pitch and yaw on that link [rad]; z of gripper_mount points to the object.",
)
@click.option(
    "--output",
    type=FILE,
    metavar="FILE",
    help="File to write. Default: print.",
)
def urdf(
    params_file: Path | None,
    node: str,
    design: Path | None,
    discretisation: str | None,
    elements_top: int | None,
    elements_beam: int | None,
    assignments: tuple[str, ...],
    prefix: str | None,
    parent: str | None,
    arm: Path | None,
    xyz: tuple[float, float, float],
    rpy: tuple[float, float, float],
    output: Path | None,
) -> None:
    """Print the gripper's robot description (URDF).

    Its joints are those of the node's joint states, for robot_state_publisher, RViz, Foxglove and
    MoveIt. What differs from the node's defaults has to be told as it was told to the node.

    On an arm: with --parent and --arm it becomes part of the arm's description. With --parent alone
    that link is the root, so that the frames join those of an arm that has a robot_state_publisher
    of its own. To include it by xacro leave both away, and attach the link gripper_mount.

    \b
    Examples:
      hma_gripper urdf --output gripper.urdf
      hma_gripper urdf --params-file sim_node.yaml --parent tool0
      hma_gripper urdf --arm arm.urdf --parent tool0 --output arm_with_gripper.urdf
      hma_gripper urdf --prefix left_ --arm arm.urdf --parent left_tool0
      hma_gripper urdf --discretisation midpoint --elements-top 2 --elements-beam 8
    """
    from hma_gripper_sim.device.parameter_file import read_parameter_file
    from hma_gripper_sim.device.settings import Settings
    from hma_gripper_sim.replay.simulated_settings import assignment
    from hma_gripper_sim.results.robot_description import gripper_urdf
    from hma_gripper_sim.yaml_reading import read_text

    given = read_parameter_file(params_file, node) if params_file else {}
    for text in assignments:
        given |= assignment(text)
    told = {
        "design": str(design) if design else None,
        "discretisation": discretisation,
        "elements_top": elements_top,
        "elements_beam": elements_beam,
        "prefix": prefix,
    }
    given |= {name: value for name, value in told.items() if value is not None}
    try:
        settings = Settings.parse(given)
    except InputError as error:
        from_file = params_file and error.field and told.get(error.field) is None
        raise error.within(
            source=error.source or (str(params_file) if from_file else None)
        ) from None
    scene = settings.scenes[settings.contour]
    carrier = read_text(arm) if arm else None
    try:
        text = gripper_urdf(
            scene,
            settings.limits,
            parent=parent,
            xyz=xyz,
            rpy=rpy,
            arm=carrier,
            prefix=settings.prefix,
        )
    except InputError as error:
        raise error.within(source=str(arm) if error.field == "arm" else None) from None
    if output is None:
        click.echo(text, nl=False)
    else:
        output.write_text(text, encoding="utf-8")
