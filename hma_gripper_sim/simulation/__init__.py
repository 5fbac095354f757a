"""The simulation of a scene, and the record of a run.

==============  ===========================================
simulation      owns the state and the solver's workspace
state           the state as others see it
trace           results of a run, sampled at a fixed period
companion_runs  runs beside a run, whose differences from it show its error
==============  ===========================================
"""
