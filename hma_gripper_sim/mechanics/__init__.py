"""A described gripper made computable.

==============  ===================================================
discretisation  beams as chains of joints and bodies
asked_accuracy  how fine a model an asked accuracy takes
start_pose      the pose in which the gripper rests before it moves
==============  ===================================================
"""
