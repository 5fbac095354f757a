"""Comparing a simulated log with an experiment, or with another log.

=============  ==================================================================
criteria       figures of a run beside what an experiment says they should be
angles         the angles of deflection at one instant, as in Table 5.3
alignment      matching the time of two logs
phases         approach, enveloping, hold and lift
errors         how far two logs differ, signal by signal and phase by phase
bounds         the errors that are allowed
comparing      all of that for one simulated log: the result
tables         the result in the terminal, and for programs
page           the result as one self-contained HTML page
pictures       its plots
command        ``hma_gripper compare``
=============  ==================================================================
"""
