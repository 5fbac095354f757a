"""The ROS 2 side: the node and what it is made of. Nothing else in the package imports rclpy.

=============  ==================================================================
settings       what can be set, its ranges, and the one place that validates it
parameters     the same as ROS parameters
mailbox        calls from ROS callbacks, carried out between two ticks
timeline       when each tick is due, and the time stamp it carries
messages       states as messages
sim_node       the node, and the program around it
=============  ==================================================================
"""
