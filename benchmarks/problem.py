"""The common problem: a truncated isotensoid of thin film under gas pressure, both rings held.

R0 = 3.8182 m, |z| <= 0.55 R0, equal steps of the elliptic argument along the meridian, NM x NC
quadrilaterals each cut into (A, B, C), (A, C, D); unstressed film E = 3.5e9 Pa, nu = 0.3, t = 5e-5 m;
5 Pa as a follower load. `taut`: as is, isotropic film, which ends in tension everywhere. `wrinkled`:
tension-only film with 1e-4 of the isotropic energy blended in, the top ring raised by 4 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobefem.geometry.isotensoid import Isotensoid

__all__ = [
    "CASES", "EXACT", "MESHES", "NU", "PRESSURE", "SHARE", "STIFFNESS", "THICKNESS", "Answer", "Case", "E",
    "Film", "film",
]  # fmt: skip

R0, PRESSURE, E, NU, THICKNESS, SHARE = 3.8182, 5.0, 3.5e9, 0.3, 5e-5, 1e-4
STIFFNESS = E * THICKNESS  # [N/m]
CASES = {"taut": 0.0, "wrinkled": 0.004}  # rise of the top ring [m]
MESHES = ((24, 32), (48, 64), (96, 128), (192, 256))

# Volume [m^3] and largest displacement [m], all digits on which lobefem and Surface Evolver agree; up to
# 96x128 NGSolve and Kratos find them too.
EXACT = {
    ("taut", (24, 32)): (148.769251754, 0.301883520e-3),
    ("taut", (48, 64)): (149.693124850, 0.365329267e-3),
    ("taut", (96, 128)): (149.924829098, 0.401299893e-3),
    ("taut", (192, 256)): (149.982805928, 0.414656532e-3),
    ("wrinkled", (24, 32)): (148.775779961, 4e-3),
    ("wrinkled", (48, 64)): (149.699841184, 4e-3),
    ("wrinkled", (96, 128)): (149.931540288, 4e-3),
    ("wrinkled", (192, 256)): (149.989510491, 4e-3),
}


@dataclass(frozen=True)
class Case:
    """One run: which film, how fine.

    Attributes:
        name: "taut" or "wrinkled".
        divisions: quadrilaterals along the meridian and around.
    """

    name: str
    divisions: tuple[int, int]

    @property
    def lift(self) -> float:
        """Rise of the top ring [m]."""
        return CASES[self.name]

    @property
    def unknowns(self) -> int:
        """Displacements of the nodes that are free."""
        return 3 * (self.divisions[0] - 1) * self.divisions[1]


@dataclass(frozen=True)
class Answer:
    """Answer of a program: enclosed volume [m^3], largest displacement [m], iterations."""

    volume: float
    displacement: float
    iterations: int | None

    def errors(self, case: Case) -> tuple[float, float]:
        """Relative errors of volume and displacement."""
        volume, displacement = EXACT[case.name, case.divisions]
        return abs(self.volume / volume - 1), abs(self.displacement / displacement - 1)

    def right(self, case: Case) -> bool:
        """Volume to 1e-7, displacement to 1e-5."""
        volume, displacement = self.errors(case)
        return volume < 1e-7 and displacement < 1e-5


@dataclass(frozen=True)
class Film:
    """The mesh, the bottom ring first: points (n, 3) [m], triangles (m, 3) with normals outwards."""

    points: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int64]
    bottom: npt.NDArray[np.int64]
    top: npt.NDArray[np.int64]

    def volume(self, displacement: npt.NDArray[np.float64]) -> float:
        """Volume [m^3] that film and flat end plates enclose, from the nodes' displacements (n, 3)."""
        x = self.points + displacement
        a, b, c = (x[self.triangles[:, k]] for k in range(3))
        total = np.einsum("ni,ni", a, np.cross(b, c)) / 6
        for ring, sign in ((self.bottom, -1), (self.top, 1)):
            r = x[ring]
            area = np.cross(r, np.roll(r, -1, axis=0)).sum(axis=0)[2] / 2
            total += sign * area * r[0, 2] / 3
        return float(total)

    def start(self, case: Case) -> npt.NDArray[np.float64]:
        """Displacements (n, 3) [m] that all programs start from: film drawn along evenly with the ring."""
        z = self.points[:, 2]
        return np.outer(z / z.max(), [0.0, 0.0, case.lift])

    def answer(self, displacement: npt.NDArray[np.float64], iterations: int | None) -> Answer:
        """The answer of displacements (n, 3) [m]."""
        largest = float(np.sqrt((displacement**2).sum(axis=1).max()))
        return Answer(self.volume(displacement), largest, iterations)


def film(case: Case) -> Film:
    """The mesh of a case, undeformed."""
    along, around = case.divisions
    lobe = Isotensoid(R0)
    s = lobe.stations(along)
    R, z = lobe.radius(s), lobe.z(s) + lobe.half_height
    theta = 2 * np.pi * np.arange(around) / around
    points = np.stack(
        [np.outer(R, np.cos(theta)), np.outer(R, np.sin(theta)), np.repeat(z[:, None], around, axis=1)],
        axis=-1,
    ).reshape(-1, 3)
    node = np.arange((along + 1) * around).reshape(along + 1, around)
    following = np.roll(node, -1, axis=1)
    a, b, c, d = node[:-1], following[:-1], following[1:], node[1:]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1, 3)
    return Film(points, triangles, node[0], node[-1])
