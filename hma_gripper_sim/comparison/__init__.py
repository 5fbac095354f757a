"""Comparing a simulated log with an experiment, or with another log.

===================  ==============================================================
experiment_criteria  figures of a run beside what an experiment says they should be
angles               the angles of deflection at one instant, as in Table 5.3
alignment            matching the time of two logs
phases               approach, enveloping, hold and lift
signal_errors        how far two logs differ, signal by signal and phase by phase
coverage             how much of a measured signal a simulated one covers
provenance           what was simulated, in words
bounds               the errors that are allowed
log_comparison       all of that for one simulated log: the result
tables               the result in the terminal, and for programs
html_page            the result as one self-contained HTML page
signal_plots         plots of both courses of a signal and of their difference
run_plots            plots of a run: force and φ over time, and the gripper closing
result_text          tables of the terminal and JSON, of any result
report               comparisons with experiments as text
===================  ==============================================================
"""
