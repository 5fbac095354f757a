"""Logging what a running node says.

===============  ====================================================
topic_logger     listens to the node, and logs what it says
parameter_query  asks a running node for its parameters
session          records until a signal, a duration or the node's end
===============  ====================================================
"""
