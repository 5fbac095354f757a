"""Programs that talk to the node.

===============  ======================================================
gripper_client   GripperClient, for programs that command the node
state_listener   what the client knows of the node
motion_sender    what it sends to it
background_node  ROS for programs that have no node
demo_client      drives the node along an experiment, and has it logged
===============  ======================================================
"""
