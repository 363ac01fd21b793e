"""One full pumpkin balloon by lobefem and by Surface Evolver: volume, lowest eigenvalue, time.

    python -m benchmarks.pumpkin_evolver --gores 64 --divisions 24x4

The same linear triangles and the same energy: tension-field film with a share of isotropic energy blended in,
tendons of engineering strain, less p V; both fittings held. Surface Evolver starts from the drawn shape,
minimises by Newton's method, and has the lowest eigenvalue of its Hessian from `eigenprobe`, each degree of
freedom counting alike (mass "nodal"). lobefem has both from one gore, and once more from all.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from lobefem.linalg import dolfinx_compat  # first: it finds the stack

# isort: split
from benchmarks.measure import run as measured
from benchmarks.programs.evolver import elements, executable
from lobefem import Balloon, EndPlates, GasPressure, NewtonOptions, TensionField, find_modes, inflate
from lobefem.equilibrium.full_model import full_state
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve

import ufl

E, NU, THICKNESS, SHARE, EA, PRESSURE = 300e6, 0.4, 38e-6, 1e-4, 1e5, 100.0


def recipe(gores: int, divisions: tuple[int, int], full: bool) -> PumpkinRecipe:
    """The isotensoid of 5 m with lobes of 60 degrees half angle."""
    gore = Gore(PumpkinCurve(5.0, 0.25), gores, ConstantAngle(math.radians(60)))
    return PumpkinRecipe(gore, divisions, cell="triangle", order=1, full=full)


def tendons(balloon: Any) -> Any:
    """EA/2 (l/l0 - 1)^2 per drawn length of the tendons in UFL [J]: Surface Evolver's strain."""
    mesh = balloon.surface.mesh
    names = sorted(name for name in balloon.surface.groups if name.startswith("tendon"))
    total: Any = 0
    for name in names[:1] if balloon.surface.copies > 1 else names:  # one gore's other one is the next gore's
        measure = balloon.measure(name)
        x, n = ufl.CellNormal(mesh), ufl.FacetNormal(mesh)
        gradient = ufl.grad(ufl.SpatialCoordinate(mesh) + balloon.u)
        if measure.integral_type() == "interior_facet":
            x, n, gradient = x("+"), n("+"), gradient("+")
        along = gradient * ufl.cross(x, n)
        total += EA / 2 * (ufl.sqrt(ufl.dot(along, along)) - 1) ** 2 * measure
    return total


def balloon(gores: int, divisions: tuple[int, int], full: bool) -> Balloon:
    """The balloon of lobefem, one gore or all."""
    film = TensionField(E=E, nu=NU, thickness=THICKNESS, slack_stiffness=SHARE)
    parts = [GasPressure("closed"), EndPlates(support="fixed", bar=False)]
    return Balloon(recipe(gores, divisions, full).surface(), film, parts, extra_energy=tendons)


def by_lobefem(gores: int, divisions: tuple[int, int], full: bool) -> dict[str, float]:
    """Volume [m^3], lowest eigenvalue [N/m] and seconds, forms compiled before."""
    start = time.perf_counter()
    state = inflate(balloon(gores, divisions, False), PRESSURE, options=NewtonOptions(rtol=1e-10))
    if full:
        state = full_state(state, balloon(gores, divisions, True))
        lowest = find_modes(state, 2, mass="nodal").lowest
    else:
        lowest = find_modes(state, 1, mass="nodal", harmonics=range(gores // 2 + 1)).lowest
    return {"volume": state.volume, "eigenvalue": lowest, "seconds": time.perf_counter() - start}


def by_evolver(gores: int, divisions: tuple[int, int]) -> dict[str, float]:
    """The same of Surface Evolver."""
    surface = recipe(gores, divisions, True).surface()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "pumpkin.fe").write_text(datafile(surface), encoding="ascii")
        job = measured([str(executable()), "pumpkin.fe"], folder, {}, "q\nq\n", 3600)
        output = Path(folder, "stdout").read_text()
    found = re.findall(r"^RESULT (\S+) (\S+) (\S+)", output, re.MULTILINE)
    if not found:
        raise SystemExit(f"Surface Evolver ended without a result:\n{output[-2000:]}")
    volume, eigenvalue, steps = (float(text) for text in found[-1])
    return {"volume": volume, "eigenvalue": eigenvalue, "seconds": job["seconds"], "steps": steps}


def datafile(surface: Any) -> str:
    """Surface Evolver's data and commands for the full balloon."""
    mesh = surface.mesh
    x = mesh.geometry.x
    t = dolfinx_compat.geometry_dofmap(mesh).astype(int)
    normal = np.cross(x[t[:, 1]] - x[t[:, 0]], x[t[:, 2]] - x[t[:, 0]])
    middle = x[t].mean(axis=1) - [0, 0, (x[:, 2].max() + x[:, 2].min()) / 2]
    inwards = (normal * middle).sum(axis=1) < 0
    t[inwards] = t[inwards][:, [0, 2, 1]]
    roped = {
        tuple(sorted(pair))
        for name in surface.groups
        if name.startswith("tendon")
        for pair in vertices_of(surface, name)
    }
    rims = [vertices_of(surface, name) for name in ("nadir", "apex")]
    held = {int(k) for rim in rims for k in rim.ravel()}
    # what the film's integral of z dx dy lacks: fans from the fittings' centres to their rims
    caps = []
    for rim in rims:
        r = x[np.unique(rim)]
        r = r[np.argsort(np.arctan2(r[:, 1], r[:, 0]))]
        after = np.roll(r, -1, axis=0)
        height = (r[:, 2] + after[:, 2] + r[:, 2].mean()) / 3
        caps.append((np.cross(r, after)[:, 2] / 2 * height).sum())

    def edge(a: int, b: int) -> str:
        rest = float(np.linalg.norm(x[a] - x[b]))
        return f" tendon hooke_size {rest!r}" if (a, b) in roped else ""

    film = elements(x, t, lambda k: " fixed" if k in held else "", edge)
    stiffness = E * THICKNESS
    return f"""// a pumpkin balloon
define edge attribute hooke_size real
define facet attribute poisson_ratio real
define facet attribute form_factors real[3]
quantity isotropic energy modulus {stiffness!r} method linear_elastic global
quantity wrinkling energy modulus 0 method relaxed_elastic_A global
quantity tendon energy modulus {EA!r} method hooke3_energy

{film}

bodies
1

read
hessian_normal off
set facet tension 0
set facet poisson_ratio {NU}
set facet frontbody 1
set body pressure {PRESSURE}
steps := 0
newton := {{
    do {{
        old := total_energy;
        hessian_seek;
        steps += 1;
    }} while abs(total_energy - old) > 1e-11*abs(total_energy) and steps < 200;
}}
newton
isotropic.modulus := {SHARE * stiffness!r}
wrinkling.modulus := {(1 - SHARE) * stiffness!r}
newton
hessian
hessian
steps += 2
ritz(0, 3)
printf "RESULT %.12f %.12g %g\\n", body[1].volume + {float(caps[1] - caps[0])!r}, last_eigenvalue, steps
q
q
"""


def vertices_of(surface: Any, name: str) -> Any:
    """The nodes of the edges of a group, (edges, 2)."""
    nodes = dolfinx_compat.entity_nodes(surface.mesh, 1, surface.facets(name))
    return np.sort(nodes.reshape(-1, 2), axis=1)


def main() -> int:
    """Run both and print their numbers."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--gores", type=int, default=64)
    parser.add_argument("--divisions", default="24x4", help="of one gore, along and across")
    parser.add_argument("--json", type=Path, help="file to write the numbers to")
    options = parser.parse_args()
    along, across = (int(part) for part in options.divisions.split("x"))
    size = (options.gores, (along, across))
    by_lobefem(8, (along, across), True)  # compiles the forms
    found = {
        "lobefem, one gore": by_lobefem(*size, False),
        "lobefem, all gores": by_lobefem(*size, True),
        "Surface Evolver": by_evolver(*size),
    }
    print(f"{options.gores} gores of {along} x {across} cells, {PRESSURE:g} Pa\n")
    print("| program | volume [m^3] | lowest eigenvalue [N/m] | seconds | ratio |\n|---|---|---|---|---|")
    least = found["lobefem, one gore"]["seconds"]
    for name, row in found.items():
        print(
            f"| {name} | {row['volume']:.9g} | {row['eigenvalue']:.9g} | {row['seconds']:.2f} "
            f"| {row['seconds'] / least:.3g} |"
        )
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
