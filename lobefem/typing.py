"""Types that signatures share: arrays by what they hold."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["Array", "ComplexArray", "Indices", "Integers"]

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
Integers = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]  # of nodes and cells, as DOLFINx has them
