"""The command line ``hma_gripper``: one file for each command.

=========  ===========================================================
main       the command whose sub-commands the others are, and ``demo``
benchmark  ``hma_gripper benchmark``
calibrate  ``hma_gripper calibrate``
compare    ``hma_gripper compare``
record     ``hma_gripper record``
replay     ``hma_gripper replay``
urdf       ``hma_gripper urdf``
=========  ===========================================================
"""
