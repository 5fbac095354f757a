"""Replaying logs: what a recorded gripper was made to do, done again by the simulation, offline.

=============  ==================================================================
parameters     what is simulated: the log's own settings, an experiment, options
course         what the gripper is made to do: commands, measured travel, a plan
replaying      the simulation along a course, in blocks, and the log of it
messages       blocks of results as serialised messages
command        ``hma_gripper replay``
=============  ==================================================================
"""
