"""What was done to a real gripper, and what was measured.

===============  =======================================
experiment       an experiment
experiment_file  experiments read from YAML files
node_parameters  an experiment as parameters of the node
===============  =======================================
"""
