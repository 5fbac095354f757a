"""A described gripper made computable.

===============  ==================================================================
scene            a scene that can be simulated
discretisations  how a beam is divided into bodies and joints, one file for each way
half_gripper     one half of a gripper as a chain of bodies and joints
body_motion      poses, velocities and accelerations of all bodies
asked_accuracy   how fine a model an asked accuracy takes
placement        where the object stands to leave a clearance
start_pose       the pose in which the gripper rests before it moves
states           one instant, and the accepted time steps of a run
outcome          how a solve ended, and the error that says so
===============  ==================================================================
"""
