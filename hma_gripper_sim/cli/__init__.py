"""The command line ``hma_gripper``: one file for each command.

============  =================================================
main          the command whose sub-commands the others are
benchmark     ``hma_gripper benchmark``
calibrate     ``hma_gripper calibrate``
compare       ``hma_gripper compare``
demo          ``hma_gripper demo``
record        ``hma_gripper record``
replay        ``hma_gripper replay``
urdf          ``hma_gripper urdf``
option_types  types of options that several commands have
============  =================================================
"""
