"""Replaying logs: what a recorded gripper was made to do, done again by the simulation, offline.

==================  =================================================================
source              what is to be replayed, read before the solver is loaded
simulated_settings  what is simulated: the log's own settings, an experiment, options
course              what the gripper is made to do: commands, measured travel, a plan
simulated_log       the simulation along a course, in blocks, and the log of it
session             a replay from what the user asks for to the comparison
log_verification    how far the simulation behind a log can be trusted
==================  =================================================================
"""
