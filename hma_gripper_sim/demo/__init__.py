"""The demonstration: objects picked up over ROS, compared with the real gripper.

====  =================================
demo  runs the experiments, and reports
====  =================================
"""
