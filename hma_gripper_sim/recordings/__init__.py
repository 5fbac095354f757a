"""Signals of a gripper, simulated or real, read from logs.

==============  ==========================================================
reading         signals, poses and single messages of a log
recording       signals over time
signal_map      where in a log each signal is
signal_sources  which numbers of a message make a signal
gathering       signals out of messages, many at a time
pose_chains     poses that a chain of transforms or joints makes up
assembly        one signal: whose, when, and in SI units
plausibility    signals that no gripper gives, and the likely cause
inspection      what is in a log
starter_map     where in a log the signals may be: a signal map to edit
stamps          time stamps that run back, jump or were never set
run_figures     the figures of a run that the thesis and experiments state
==============  ==========================================================
"""
