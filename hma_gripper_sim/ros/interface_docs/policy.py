"""The SROS2 policy that grants what the node needs, and nothing else."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from hma_gripper_sim.device.topics import NODE
from hma_gripper_sim.ros.interface_docs.endpoints import Endpoint, Interface

_ABOUT = """
    What sim_node takes, publishes and serves with the shipped parameters, in either role about the
    clock (publish_clock, use_sim_time). Written by `make docs`; docs/ros_interface.md says how to
    use it, and what to change for other objects or another namespace.
  """


def security_policy(interface: Interface) -> str:
    """Return the policy in the format of ``ros2 security generate_policy``."""
    policy = ET.Element("policy", version="0.2.0")
    policy.append(ET.Comment(_ABOUT))
    enclave = ET.SubElement(ET.SubElement(policy, "enclaves"), "enclave", path=NODE)
    profiles = ET.SubElement(enclave, "profiles")
    profile = ET.SubElement(profiles, "profile", ns="/", node=NODE.strip("/"))
    _grant(profile, "topic", "subscribe", interface.subscriptions)
    _grant(profile, "topic", "publish", interface.publishers)
    _grant(profile, "service", "reply", interface.services)
    ET.indent(policy)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(policy, encoding="unicode")}\n'


def _grant(profile: ET.Element, what: str, right: str, endpoints: Iterable[Endpoint]) -> None:
    granted = ET.SubElement(profile, f"{what}s", {right: "ALLOW"})
    for endpoint in endpoints:
        ET.SubElement(granted, what).text = endpoint.name
