"""The contours of objects.

===========  =====================================================================
shapes       circles, rounded boxes and convex polygons, and reading one from YAML
from_camera  outlines as a camera sees them, made into convex polygons
===========  =====================================================================
"""
