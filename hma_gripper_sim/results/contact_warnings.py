"""Warnings of contacts that the contact model does not describe."""

from __future__ import annotations

import math

from hma_gripper_sim.mechanics.scene import Scene

OTHER_TIP_NAME = "other tip"
SHALLOW = 0.1
"""Penetration relative to the tip's radius up to which it is small.

Contact is found on undeformed outlines.  A tip that sinks in by a share of its radius touches with
its outline that much off: place and direction of the force err by as large a share.
"""


MORE = 1.5
"""Share of a penetrating contact's force that a stiffer one is expected to bear at most."""


class UnmodelledContactWarning(UserWarning):
    """A part that the contact model leaves out would have touched something.

    Attributes
    ----------
    part, side
        Which part, and of which half.
    time
        Of the first touch [s].
    place
        In world coordinates (x, z) [m].
    """

    def __init__(self, part: str, side: str, time: float, place: tuple[float, float]) -> None:
        self.part = part
        self.side = side
        self.time = time
        self.place = place
        super().__init__(part, side, time, place)

    def __str__(self) -> str:
        tips = self.part == OTHER_TIP_NAME
        what = "each other" if tips else "the object"
        subject = "the tips" if tips else f"the {self.side} {self.part}"
        x, z = self.place
        return (
            f"{subject} would touch {what} at t = {self.time:.4g} s, "
            f"x = {1e3 * x:.3g} mm, z = {1e3 * z:.3g} mm: "
            "not modelled, the results from there on are not to be trusted"
        )


class PenetrationWarning(UserWarning):
    """The tips sink into the object by more than is small against their radius.

    Attributes
    ----------
    depth
        The largest in the run [m].
    time
        When it was reached [s].
    stiffness
        Normal stiffness of the contact that would make it small [N/m]: for the same force, and
        half as much again because a stiffer contact may have to bear more.
    """

    def __init__(self, scene: Scene, depth: float, time: float) -> None:
        self.depth = depth
        self.time = time
        self.stiffness = MORE * scene.normal_stiffness * depth / (SHALLOW * scene.design.tip.radius)
        super().__init__(scene, depth, time)

    def __str__(self) -> str:
        radius = self.args[0].design.tip.radius
        return (
            f"a tip sinks {1e3 * self.depth:.3g} mm into the object at t = {self.time:.4g} s, more "
            f"than {100.0 * SHALLOW:g} % of its radius of {1e3 * radius:.3g} mm: the contact's "
            "place and direction are not to be trusted; "
            f"normal_stiffness={_rounded_up(self.stiffness):g} N/m would do"
        )


def is_deep(scene: Scene, depth: float) -> bool:
    """Whether a penetration [m] is no longer small against the tip's radius."""
    return depth > SHALLOW * scene.design.tip.radius


def _rounded_up(value: float) -> float:
    """Rounded up to two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / unit) * unit
