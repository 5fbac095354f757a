"""How a beam is divided into rigid bodies and joints: one file for each way.

=======  ==================================================================
base     what a discretisation has to say of itself
by_name  all of them, by name
=======  ==================================================================
"""
