"""What a person describes: a gripper, an object, and the scene of both.

===========  ============================================================
gripper      the design of a gripper: beams, material, tips
contours     the shapes that objects have
scene        a gripper above an object, with the contact law between them
joint_names  the names of the gripper's joints
===========  ============================================================
"""
