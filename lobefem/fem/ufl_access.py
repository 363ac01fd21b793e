"""A balloon in UFL, for forms of one's own: its energy, residual and tangent, measures of its named parts."""

from __future__ import annotations

from typing import Any

import numpy as np

from lobefem.errors import InputError

import ufl
from dolfinx.mesh import exterior_facet_indices

__all__ = ["UflAccess"]


class UflAccess:
    """Access to a balloon for someone who writes UFL."""

    surface: Any
    forms: Any
    dx: Any  # the film's measure, with its quadrature rule

    def measure(self, name: str) -> Any:
        """The measure over a named part: dx of a region, ds of free edges, dS of edges within the film.

        Integrands of dS are restricted, as `u("+")`.

        Raises:
            InputError: a name that the surface does not have, or edges both free and within the film.

        Collective.
        """
        return _named_measure(self.surface, name, self.dx.metadata())

    @property
    def energy_ufl(self) -> Any:
        """Potential energy of film, cables, weight, `closed` gas on the film, and `extra_energy` [J].

        The three forms are in `u`, `pressure` and `prestress`, without the share of plates and contact.

        Raises:
            InputError: a film law or a load without potential.
        """
        return self.forms.energy_ufl

    @property
    def residual_ufl(self) -> Any:
        """Nodal residual [N]: the energy's derivative, or what has none as it is written."""
        return self.forms.residual_ufl

    @property
    def tangent_ufl(self) -> Any:
        """Derivative of `residual_ufl` by `u` [N/m]."""
        return self.forms.tangent_ufl


def _named_measure(surface: Any, name: str, metadata: dict[str, Any]) -> Any:
    """The measure over a named part, see `UflAccess.measure`; metadata are the film's."""
    tags, value = surface.tags(name)
    mesh = surface.mesh
    if surface.groups[name][0] == 2:
        return ufl.Measure("dx", domain=mesh, subdomain_data=tags, metadata=metadata)(value)
    mesh.topology.create_connectivity(1, 2)
    facets = tags.find(value)
    facets = facets[facets < mesh.topology.index_map(1).size_local]
    free = np.isin(facets, exterior_facet_indices(mesh.topology)).sum()
    free, count = mesh.comm.allreduce(np.array([free, len(facets)])).tolist()
    if count == 0:
        raise InputError(f"edge group '{name}' is empty: there is nothing to integrate over")
    if 0 < free < count:
        raise InputError(
            f"edge group '{name}' has {free} free edges and {count - free} within the film, which take two "
            "measures; tag them by two names"
        )
    return ufl.Measure("ds" if free else "dS", domain=mesh, subdomain_data=tags)(value)
