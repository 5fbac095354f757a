"""The command line ``hma_gripper``: one file for each command.

============  =================================================
main          the command whose sub-commands the others are
benchmark     ``hma_gripper benchmark``
calibrate     ``hma_gripper calibrate``
compare       ``hma_gripper compare``
demo          ``hma_gripper demo``
inspect       ``hma_gripper inspect``
record        ``hma_gripper record``
replay        ``hma_gripper replay``
urdf          ``hma_gripper urdf``
printing      tables and notes on a terminal or in a pipe
option_types  types of options that several commands have
============  =================================================
"""
