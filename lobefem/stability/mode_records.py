"""`Mode` and `Modes`: eigenpairs of a state with their shapes, harmonics and kinds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.display import Summarized, Summary
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import displacement_of, largest
from lobefem.fem.rigid_motions import is_turn, num_turns
from lobefem.frozen import Frozen
from lobefem.geometry import gather
from lobefem.linalg.slepc import Pair
from lobefem.outcomes import RIGID
from lobefem.stability.fourier import dominant, spectrum
from lobefem.stability.mode_kinds import kind_of
from lobefem.typing import Array, Mass, Vec

__all__ = ["NEUTRAL", "Mode", "Modes", "is_rotation", "make_mode"]

# eigenvalues below this share of p/sqrt(A) are round-off
NEUTRAL = 1e-6


@dataclass(frozen=True)
class Mode(Frozen):
    """One eigenpair.

    Attributes:
        value: eigenvalue lambda [Pa/m with unit mass, N/m with nodal mass].
        residual: ||K phi - lambda B phi||/||K phi||; 0 for a rigid rotation, whose vector is known.
        harmonic: circumferential harmonic n, the one that was solved for or else the dominant one.
        harmonics: that and all others with at least a tenth of the mode, strongest first.
        kind: "sway", "twist", "global" or "local" (see `lobefem.stability.mode_kinds.kind_of`), or "rigid
            rotation".
        displacement: this rank's nodal displacements of phi, ghosts included, (nodes, 3), real part,
            largest nodal displacement 1. Of one sector, those of the first one: the j-th one's are
            Re((real + i imag) e^{2 pi i n j/N}), rotated with it.
        displacement_imag: imaginary part on the same scale; zero for a real eigenvalue of a whole balloon.
        points: this rank's nodes as meshed, ghosts included, (nodes, 3) [m].
    """

    value: complex
    residual: float
    harmonic: int
    harmonics: tuple[int, ...]
    kind: str
    displacement: Array = field(repr=False)
    displacement_imag: Array = field(repr=False)
    points: Array = field(repr=False)

    def nodes(self) -> Array:
        """This rank's nodes as meshed, in the order of `displacement`, ghosts included, (nodes, 3) [m]."""
        return self.points

    @property
    def rigid(self) -> bool:
        """True if the mode is a rigid rotation that the supports leave free."""
        return self.kind == RIGID


@dataclass(frozen=True, repr=False)
class Modes(Summarized):
    """The lowest modes of a state, sorted by the real part of lambda.

    Attributes:
        state: the state that they belong to.
        mass: "unit" or "nodal".
        symmetric: whether the tangent was found symmetric, and the Hermitian solver used.
        asymmetry: max|K - K^T|/max|K|.
        num_negative: eigenvalues below zero in the whole spectrum by the inertia of K, those of rigid
            rotations left out; None where K is not symmetric or not all harmonics were looked at.
        modes: the pairs. Among them, where supports leave some, are rigid rotations of the whole balloon.
            Nothing resists these, in equilibrium their values are 0; in the held ideal geometry, which
            balances up to discretisation, phi.K phi/phi.B phi shows the error. All other modes are those
            of K on the motions that are orthogonal to them by mass.
        by_harmonic: of a state of one sector, n and its lowest lambda of each harmonic that was looked at,
            free rotations left out.
    """

    state: Equilibrium = field(repr=False)
    mass: Mass
    symmetric: bool
    asymmetry: float
    num_negative: int | None
    modes: tuple[Mode, ...]
    by_harmonic: tuple[tuple[int, float], ...] = ()

    @property
    def values(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues (count,)."""
        return np.array([m.value for m in self.modes])

    @property
    def stable(self) -> bool:
        """True if all eigenvalues but those of rigid rotations have a positive real part."""
        return self.lowest > 0

    @property
    def lowest(self) -> float:
        """The lowest real part of an eigenvalue, those of rigid rotations left out."""
        return min((m.value.real for m in self.modes if not m.rigid), default=math.inf)

    def to_pyvista(self, index: int = 0) -> Any:
        """The film with one mode as a PyVista grid on rank 0, None elsewhere. Collective.

        Points are where the state's nodes are, in the order of `Mode.nodes` and `Mode.displacement`, those of
        rank 0 first. Point data "mode" and "mode_imag" (largest length 1), and the state's "displacement"
        [m]; cell data "lobe". `grid.warp_by_vector("mode", factor=0.3)` is the balloon as it moves. Rank 0
        gathers all of it: see `lobefem.geometry.gather.gather` for what that takes.

        Raises:
            InputError: no such mode.
        """
        if not 0 <= index < len(self):
            raise InputError(f"mode {index} is not there; choose from 0 to {len(self) - 1}")
        balloon, mode = self.state.balloon, self[index]
        fields = {
            "displacement": self.state.displacement,
            "mode": mode.displacement,
            "mode_imag": mode.displacement_imag,
        }
        nodal = {name: gather.at_nodes(balloon.V, field) for name, field in fields.items()}
        whole = gather.gather(balloon.mesh, nodal, {"lobe": balloon.surface.lobe_numbers()}, balloon.V)
        if whole is None:
            return None
        grid = gather.to_pyvista(whole)
        grid.points = whole.x + whole.nodal["displacement"]
        grid.set_active_vectors("mode")
        return grid

    def _summary(self) -> Summary:
        unit = "Pa/m" if self.mass == "unit" else "N/m"
        rows = tuple(
            (
                f"{mode.kind}, n = {mode.harmonic}",
                f"{mode.value.real:.6g}" + (f" {mode.value.imag:+.3g}i" if mode.value.imag else ""),
                f"{mode.residual:.0e}",
            )
            for mode in self.modes
        )
        verdict = "stable" if self.stable else "unstable"
        title = f"{len(self)} lowest at {self.state.pressure:g} Pa, {verdict}"
        return Summary(title, rows, ("mode", f"eigenvalue [{unit}]", "residual"))

    def __len__(self) -> int:
        return len(self.modes)

    def __getitem__(self, index: int) -> Mode:
        return self.modes[index]


def is_rotation(balloon: Balloon, q: Vec, real: Array, imag: Array) -> bool:
    """True if nodal displacements are those of a rigid rotation that the supports leave. Collective."""
    if not num_turns(balloon):
        return False
    balloon.set_unknowns(q)
    displacement = balloon.u.x.array.reshape(-1, 3)
    return all(is_turn(balloon, displacement, part) for part in (real, imag) if largest(balloon, part))


def make_mode(balloon: Balloon, q: Vec, pair: Pair, error: float, harmonic: int | None = None) -> Mode:
    """The `Mode` of an eigenvector in q. Collective.

    Args:
        balloon: whose.
        q: the state.
        pair: eigenvalue and vector.
        error: relative residual.
        harmonic: that of which it is a mode; None where its shape has to tell.
    """
    real, imag = displacement_of(balloon, q, pair.x), displacement_of(balloon, q, pair.y)
    scale = largest(balloon, real + 1j * imag)
    real /= scale
    imag /= scale
    power = spectrum(balloon, real, imag)
    strongest = dominant(power)
    n = strongest[0] if harmonic is None else harmonic
    return Mode(
        value=pair.value,
        residual=error,
        harmonic=n,
        harmonics=(n, *(k for k in strongest if k != n and power[k] >= 0.1)),
        kind=RIGID if is_rotation(balloon, q, real, imag) else kind_of(balloon, real + 1j * imag, n),
        displacement=real,
        displacement_imag=imag,
        points=balloon.X,
    )
