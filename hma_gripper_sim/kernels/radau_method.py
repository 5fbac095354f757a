"""Coefficients of the three-stage Radau IIA method: order 5, stage order 3.

E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, IV.8 (RADAU5).  Kernels see
these arrays as constants.
"""

from __future__ import annotations

import numpy as np

ROOT = np.sqrt(6.0)
NODES = np.array([(4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0, 1.0])
_WEIGHTS = np.array(
    [
        [(88 - 7 * ROOT) / 360, (296 - 169 * ROOT) / 1800, (-2 + 3 * ROOT) / 225],
        [(296 + 169 * ROOT) / 1800, (88 + 7 * ROOT) / 360, (-2 - 3 * ROOT) / 225],
        [(16 - ROOT) / 36, (16 + ROOT) / 36, 1 / 9],
    ]
)
INVERSE = np.linalg.inv(_WEIGHTS)
"""Rates at the stages for the increments since the step's start, times its length."""

_values, _right = np.linalg.eig(INVERSE)
_left = np.linalg.inv(_right)
_real = int(np.argmin(np.abs(_values.imag)))
_complex = int(np.argmax(_values.imag))
GAMMA = float(_values[_real].real)
ALPHA_BETA = complex(_values[_complex])
"""The eigenvalues of `INVERSE`: this, and this with its conjugate."""

_scale = _right[0, _real]
FROM_REAL = np.ascontiguousarray((_right[:, _real] / _scale).real)
TO_REAL = np.ascontiguousarray((_left[_real] * _scale).real)
FROM_COMPLEX = np.ascontiguousarray(2.0 * _right[:, _complex])
TO_COMPLEX = np.ascontiguousarray(_left[_complex])
"""Stage vectors are ``FROM_REAL x + Re(FROM_COMPLEX y)``, `x` and `y` their sums with ``TO``."""

# A polynomial of degree 3 that is 0 at the step's start and has values `f` at the stages is
# ``sum_ij POLYNOMIAL[j, i] f_i theta^(j + 1)`` at the share `theta` of the step.
POLYNOMIAL = np.linalg.inv(NODES[:, None] ** np.arange(1, 4))

# The embedded solution of order 3, which also uses the rate at the step's start, differs by
# ``EMBEDDED z / GAMMA``; of increments that are linear in time it is exact.
EMBEDDED = np.array([-13.0 - 7.0 * ROOT, -13.0 + 7.0 * ROOT, -1.0]) / 3.0
QUADRATURE = _WEIGHTS[2].copy()
"""Weights of the stages in an integral over the step, relative to its length."""
