"""What a run says beyond the joints: moments, energy, forces, warnings and pictures.

===================  =============================================================
bending_moments      bending moments of the beams' sections
energy_balance       work done, energy stored and energy dissipated
contact_forces       contact forces of a state, with the places where they act
contact_warnings     warnings of contacts that the contact model does not describe
unmodelled_contacts  touches of parts that the contact model leaves out
sampled_contour      what fits between two points of a sampled tip
error_estimate       the error of a run, from runs that should give the same
observation          what of a run its validity is judged by
validity             where a run leaves what its model describes
gripper_outline      outlines of the gripper's parts, for drawing
robot_description    the gripper as a URDF
===================  =============================================================
"""
