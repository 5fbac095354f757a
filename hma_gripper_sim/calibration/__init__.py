"""Calibration: the parameters of a scene for which it follows an experiment best.

===============  ========================================================
free_parameters  what may be free, with units and bounds
observations     what was measured, and the same out of a simulation
fitting          weighted least squares, standard errors and correlations
tables           the result in the terminal, and for programs
===============  ========================================================
"""
