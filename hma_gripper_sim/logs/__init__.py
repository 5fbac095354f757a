"""Logs of a gripper, simulated or real: writing them, and reading signals and poses back.

==============  ==================================================================
reader          signals, poses and single messages of a log
recording       signals over time
storage         opens a log, however it is stored
mcap_file       reads mcap files from front to back, whole or not
mcap_records    the records that these are made of
bag_file        reads ROS 1 bags from front to back, whole or not
messages        messages as bytes, many at a time
layout          where in these bytes the numbers lie
signals         which of the numbers make a signal
signal_map      where in a log each signal is
gathering       signals out of messages, many at a time
assembly        one signal: whose, when, and in SI units
timing          time that runs back, jumps or was never set
topics          what the node publishes and takes
writer          writes rosbag2 directories
mcap_storage    the mcap file in these: with checksums, readable whenever it ends
record_command  ``hma_gripper record``
figures         the figures of a run that the thesis and experiments state
==============  ==================================================================
"""
