"""Numbers by station along a pumpkin's tendons."""

import numpy as np
import pytest

from lobefem.errors import InputError
from lobefem.geometry.natural_curve import NaturalCurve
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.geometry.station_table import StationTable

CURVES = [
    PumpkinCurve(5.0, (0.25, 0.4)),
    NaturalCurve(payload=100.0, gradient=1.0, pressure=20.0, fitting_radii=(0.1, 0.2)),
]


@pytest.mark.parametrize("curve", CURVES)
def test_points_of_the_curve_have_the_values_of_their_stations(curve):
    table = StationTable(curve, (0.0, 0.3, 1.0), (0.01, 0.03, -0.01))
    s = np.linspace(0.0, 1.0, 23)
    r, z = curve.radius(s * curve.arc_length), curve.z(s * curve.arc_length)
    azimuth = 0.7
    points = np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), z])
    assert table(points) == pytest.approx(np.interp(s, table.stations, table.values), abs=1e-6)
    assert table.mean == pytest.approx(0.3 * 0.02 + 0.7 * 0.01)


@pytest.mark.parametrize("rows", [((0.0,), (0.1,)), ((0.0, 0.5), (0.1, 0.2)), ((0.0, 1.0), (0.1, np.nan)),
                                  ((0.0, 0.7, 0.7, 1.0), (0, 0, 0, 0)), ((0.0, 1.0), (0.1,))])  # fmt: skip
def test_what_is_no_table(rows):
    with pytest.raises(InputError, match="give stations that ascend from 0 to 1"):
        StationTable(CURVES[0], *rows)
