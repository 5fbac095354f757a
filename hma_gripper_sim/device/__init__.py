"""The gripper as a device, without ROS.

===================  =========================================================
setting_definitions  what can be set: names, ranges, defaults and descriptions
settings             what is set: the one place that validates it
parameter_file       a ROS parameter file, read without ROS
drive                follows commands within its limits, one tick after the other
arbitration          several sources of commands for one drive
request_queue        calls from other threads, carried out between two ticks
tick_schedule        when each tick is due, and the time stamp it carries
topics               the topics of the device
tick_messages        what is published every tick, as bytes
===================  =========================================================
"""
