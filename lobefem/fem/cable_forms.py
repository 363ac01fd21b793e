"""A balloon's cables as terms of one form, whatever their number: each edge has numbers of its own.

A form has no coefficients on edges. Here a cell keeps one number for each of its edges, of which the edge's
normal in the reference cell picks the edge's own. So what is compiled knows neither how many groups of
edges there are nor their tags, and groups may share nodes and cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.geometry.surface import Surface
from lobefem.linalg import dolfinx_compat
from lobefem.model.cables import Cables
from lobefem.typing import Array, Comm, Expr, Form

import basix
import ufl
from dolfinx import fem
from dolfinx.mesh import compute_midpoints, exterior_facet_indices, meshtags

__all__ = ["CableForms", "CableTerm"]

Facets = npt.NDArray[np.int32]

_INNER, _FREE = 1, 2  # tags of edges within the film and of free ones


@dataclass(frozen=True)
class CableTerm:
    """The first, or second, ... cable on edges of one kind: one term of a weak form.

    Attributes:
        measure: over the edges, dS within the film and ds on free ones.
        side: what to restrict to, "+" within the film, None on free edges.
        layer: how many other cables lie on the same edges before this one.
        EA: axial stiffness [N], 0 on edges without such a cable.
        built_in: strain built into the cable per Pa of prestress.
        rest: strain of the drawn edge over the cable at rest, None where no cable differs from its edge.
        bears: 1 for a cable that bears compression, 0 for one that does not; None where all do.
    """

    measure: Any
    side: str | None
    layer: int
    EA: Any
    built_in: Any
    rest: Any = None
    bears: Any = None

    def shortened(self, share: Expr) -> CableTerm:
        """The same cable, at rest shorter by a share of its length, in UFL."""
        left = (1 - (0 if self.rest is None else 2 * self.rest)) * (1 - share) ** 2
        return replace(self, EA=self.EA / (1 - share) ** 3, rest=(1 - left) / 2)

    def strain(self, edge: Expr) -> Any:
        """Strain of the cable of that of its edge."""
        return edge if self.rest is None else edge + self.rest

    def force(self, strain: Expr) -> Any:
        """EA e, the second Piola-Kirchhoff tension [N]."""
        if self.bears is None:
            return self.EA * strain
        return self.EA * ufl.conditional(ufl.gt(strain, 0), strain, self.bears * strain)

    def energy(self, strain: Expr) -> Any:
        """EA/2 e^2 per drawn length [J/m]."""
        return self.force(strain) * strain / 2


class CableForms:
    """All cables of a balloon.

    Args:
        surface: where they lie.
        cables: parts of the balloon.
        prestressed: whether the shape's own seam tension is built into them.

    Attributes:
        strands: what to sum over for all cables, empty without any.

    Raises:
        InputError: a cable on an edge group that is empty, or lies on free edges and within the film.

    Collective.
    """

    def __init__(self, surface: Surface, cables: tuple[Cables, ...], prestressed: bool) -> None:
        self.mesh = mesh = surface.mesh
        laid = [(cable, name) for cable in cables for name in cable.groups(surface)]
        self.terms: tuple[CableTerm, ...] = ()
        if not laid:
            return
        mesh.topology.create_connectivity(1, 2)
        mesh.topology.create_connectivity(2, 1)
        free = exterior_facet_indices(mesh.topology)
        names = [name for _, name in laid]
        tags = [surface.groups[name][1] for name in names]
        owned = mesh.topology.index_map(1).size_local
        facets = [found[found < owned] for found in map(surface.facets, names)]
        kinds = _kinds(mesh.comm, names, facets, free)
        every = np.unique(np.concatenate(facets)).astype(np.int32)
        tagged = meshtags(mesh, 1, every, np.where(np.isin(every, free), _FREE, _INNER).astype(np.int32))
        measures = {
            kind: ufl.Measure(name, domain=mesh, subdomain_data=tagged)(kind)
            for kind, name in ((_INNER, "dS"), (_FREE, "ds"))
        }
        cell = getattr(basix.CellType, mesh.topology.cell_name())
        self._normals = basix.cell.facet_outward_normals(cell)
        edges = mesh.topology.connectivity(2, 1).array.reshape(-1, len(self._normals))
        self._layers = [tags[:k].count(tag) for k, tag in enumerate(tags)]
        # of each group the numbers that cells keep for its edges: which cell's, and which of them
        self._places = [np.nonzero(np.isin(edges, some)) for some in facets]
        size = (max(self._layers) + 1) * len(self._normals)
        self._V = fem.functionspace(mesh, ("DG", 0, (size,)))
        EA, built_in, rest, bears = (fem.Function(self._V) for _ in range(4))
        for k, (cable, _) in enumerate(laid):
            shares = cable.shares(self._middles(edges[self._places[k]]))
            _require_lengths(mesh.comm, shares)
            EA.x.array[self._at(k)] = cable.reduced_stiffness(shares)
            rest.x.array[self._at(k)] = cable.reduced_strain(shares)
            bears.x.array[self._at(k)] = not cable.tension_only
            if prestressed:
                built_in.x.array[self._at(k)] = _tension(cable, surface) / cable.EA
        used = [EA, built_in]
        used.append(rest if any(cable.shortened for cable in cables) else None)
        used.append(bears if any(cable.tension_only for cable in cables) else None)
        terms = []
        for kind, layer in sorted(set(zip(kinds, self._layers, strict=True))):
            side = "+" if kind == _INNER else None
            numbers = (None if f is None else self._pick(f, side, layer) for f in used)
            terms.append(CableTerm(measures[kind], side, layer, *numbers))
        self.terms = tuple(terms)

    def compile(self, densities: Sequence[Any]) -> Any:
        """A form for `sums`, of what each of the strands has per length, in UFL. Collective."""
        test = ufl.TestFunction(self._V)
        terms = [
            density * self._pick(test, term.side, term.layer) * term.measure
            for density, term in zip(densities, self.terms, strict=True)
        ]
        return dolfinx_compat.form(sum(terms[1:], terms[0]))

    def sums(self, form: Form) -> Array:
        """Integrals of a compiled form, over all ranks, for each cable on each of its groups. Collective."""
        values = fem.assemble_vector(form).array
        found = np.array([values[self._at(k)].sum() for k in range(len(self._layers))])
        return np.asarray(self.mesh.comm.allreduce(found))

    def _middles(self, facets: Facets) -> Array:
        """Points amid edges at rest (n, 3) [m]."""
        if not len(facets):
            return np.zeros((0, 3))
        return np.asarray(compute_midpoints(self.mesh, 1, np.ascontiguousarray(facets, dtype=np.int32)))

    def _at(self, group: int) -> Any:
        """Places in a vector of the numbers that cells keep for a group's edges."""
        cells, which = self._places[group]
        first = self._V.dofmap.bs * self._V.dofmap.list[cells, 0]
        return first + self._layers[group] * len(self._normals) + which

    def _pick(self, numbers: Expr, side: str | None, layer: int) -> Any:
        """An edge's own of the numbers that a cell keeps, in UFL."""
        normal = ufl.classes.ReferenceNormal(self.mesh)
        if side:
            normal, numbers = normal(side), numbers(side)
        first = layer * len(self._normals)
        return sum(
            ufl.conditional(ufl.gt(ufl.dot(normal, ufl.as_vector(own)), 0.9), 1.0, 0.0) * numbers[first + k]
            for k, own in enumerate(self._normals.tolist())
        )


def _require_lengths(comm: Comm, shares: Array) -> None:
    """Refuse foreshortenings that a function gives and that are none. Collective."""
    if comm.allreduce(int((~(np.abs(shares) < 0.5)).sum())):  # NaN is none either
        raise InputError(
            "a cable's foreshortening is a function whose values are not all between -0.5 and 0.5; give "
            "shares of its length, as 0.02 for 2 %"
        )


def _kinds(comm: Comm, names: list[str], facets: list[Facets], free: Facets) -> list[int]:
    """True if each group is of edges within the film or of free ones.

    Args:
        comm: of the mesh.
        names: of the groups.
        facets: of the groups, that this rank owns.
        free: all such facets of one cell.

    Raises:
        InputError: a group is empty, or has both.

    Collective.
    """
    here = [[np.isin(some, free).sum(), some.size] for some in facets]
    kinds = []
    for name, (num_free, num) in zip(names, comm.allreduce(np.array(here)), strict=True):
        if not num:
            raise InputError(f"edge group '{name}' is empty: there is no edge for a cable; tag its facets")
        if 0 < num_free < num:
            raise InputError(
                f"edge group '{name}' has {num_free} facets on a free edge and {num - num_free} within the "
                "film; give each a group and a cable of its own"
            )
        kinds.append(_FREE if num_free else _INNER)
    return kinds


def _tension(cable: Cables, surface: Surface) -> float:
    """Tension in a cable per Pa of prestress [N/Pa]."""
    if cable.tension_per_pressure is not None:
        return cable.tension_per_pressure
    return float(surface.lobe.seam_tension(1.0))
