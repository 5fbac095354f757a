"""Compiled arithmetic: plain functions on arrays and named tuples, no classes, no I/O."""
