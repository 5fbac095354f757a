"""The simulation of a scene, and the record of a run.

==============  ===========================================
simulation      owns the state and the solver's workspace
outcome         how a simulation ended
accepted_steps  the time steps that the solver accepted
trace           results of a run, sampled at a fixed period
error_estimate  the error that a run estimates of itself
==============  ===========================================
"""
