"""`horizontal_displacements`: what is drawn, and where."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from states import nodes

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.end_plates import EndPlates
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField
from lobefem.viz.contours import horizontal_displacements


def test_shapes_are_to_scale_and_share_their_bands(comm):
    surface = lobed_cylinder(1, (4, 8), comm=comm)
    balloon = Balloon(surface, TensionField(), [GasPressure("closed"), EndPlates()])
    straight = np.zeros_like(nodes(balloon))
    pushed = straight + np.array([1.0, 0.0, 0.0])
    figure = horizontal_displacements(balloon, [("straight", straight), ("pushed", pushed)])
    assert (figure is None) == (comm.rank > 0)
    if figure is not None:
        left, right, _ = figure.axes
        assert (left.get_title(), right.get_title()) == ("straight", "pushed")
        assert left.get_xlim() == right.get_xlim()
        spans, colours = [], []
        for axes in (left, right):
            (faces,) = (c for c in axes.collections if isinstance(c, PolyCollection))
            corners = np.concatenate([path.vertices for path in faces.get_paths()])
            spans.append((corners[:, 0].min(), corners[:, 0].max()))
            colours.append(np.unique(faces.get_facecolors(), axis=0))
        np.testing.assert_allclose(np.subtract(spans[1], spans[0]), 1.0, atol=1e-12)
        assert [len(c) for c in colours] == [1, 1]  # round-off draws no border
        assert not np.allclose(*colours)
    with pytest.raises(InputError, match="no shape to draw"):
        horizontal_displacements(balloon, [])
