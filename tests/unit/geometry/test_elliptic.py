"""Elliptic functions against SciPy's."""

import numpy as np
import pytest
from scipy.special import ellipeinc, ellipj, ellipk

from lobefem.geometry.elliptic import jacobi, quarter_period

pytestmark = pytest.mark.serial


@pytest.mark.parametrize("m", [0.0, 0.1, 0.5, 0.99])
def test_they_are_scipys_to_round_off(m):
    u = np.linspace(-2, 2, 101).reshape(1, 101) * ellipk(m)
    sn, cn, dn, amplitude = ellipj(u, m)
    for found, known in zip(jacobi(u, m), (sn, cn, dn, ellipeinc(amplitude, m)), strict=True):
        np.testing.assert_allclose(found, known, rtol=0, atol=1e-14)
    assert quarter_period(m) == pytest.approx(ellipk(m), rel=1e-15)
