"""The ROS 2 side: the node and what it is made of. Nothing else in the package imports rclpy.

=============  ==================================================================
sim_node       the executable; light, so that it is ready for signals at once
program        ROS, threads and signals around the node
node           the node: requests to the drive, and the ticks
commands       the topics that command the drive, and what their messages say
outputs        everything that the node publishes
messages       states as messages
markers        pictures as messages
diagnostics    the node's reports about itself
fields         what can be set, with ranges and descriptions
settings       what is set: the one place that validates it
parameters     the same as ROS parameters
mailbox        calls from ROS callbacks, carried out between two ticks
timeline       when each tick is due, and the time stamp it carries
arguments      ROS arguments on the command line
=============  ==================================================================
"""
