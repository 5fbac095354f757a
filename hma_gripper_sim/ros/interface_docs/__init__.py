"""What the node offers to others, read from the node and written down.

``python -m hma_gripper_sim.ros.interface_docs`` (or ``make docs``) writes docs/ros_interface.md and
config/sros2/policy.xml of a checkout.
"""
