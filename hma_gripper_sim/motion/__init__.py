"""The motion of the prismatic joint: prescribed or planned, and what may limit it.

=================  =============================================================
prescribed_motion  velocities and travels as polynomials of time
velocity_function  a velocity given as a function of time, followed to its kinks
trajectory         way points in time, and the spline through them
trapezoid          way points from rest to rest
drive_limits       the limits of the drive
=================  =============================================================
"""
