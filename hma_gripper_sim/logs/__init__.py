"""Logs of a gripper, simulated or real: writing them, and reading signals and poses back."""
