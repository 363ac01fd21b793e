"""Surface Evolver (Brakke): minimises the film's energy less p V by Newton's method.

Its `relaxed_elastic_A` is the tension-only film, `linear_elastic` the isotropic one.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.problem import NU, PRESSURE, SHARE, STIFFNESS, Answer, Case, film
from benchmarks.programs import PEERS, Job

NAME = "Surface Evolver"


def missing() -> str | None:
    """Reason why it cannot run, None if it can."""
    return None if executable() else "evolver-nox-d is not there (Debian: evolver-nox)"


def unable(case: Case) -> str | None:
    """It can do all cases."""
    return None


def prepare(case: Case, folder: Path) -> Job:
    """Write the datafile; the commands in it do all."""
    (folder / "film.fe").write_text(_datafile(case), encoding="ascii")
    command = [str(executable()), "film.fe"]
    return Job(command, stdin="q\nq\n")


def answer(case: Case, folder: Path, output: str) -> Answer:
    """Read the last line of the commands."""
    found = re.findall(r"^RESULT (\S+) (\S+) (\S+)", output, re.MULTILINE)
    volume, displacement, iterations = found[-1]
    return Answer(float(volume), float(displacement), int(float(iterations)))


def executable() -> str | None:
    """Its program, with its own libraries or Debian's; None where there is none."""
    ours = PEERS / "debian/usr/bin/evolver-nox-d"
    return str(ours) if os.access(ours, os.X_OK) else shutil.which("evolver-nox-d")


_TAUT = """
    isotropic.modulus := {stiffness};
    newton;
"""
# a first step of isotropic film: the relaxed one has no stiffness yet across the wrinkles
_WRINKLED = """
    set vertex z (z*{stretch});
    isotropic.modulus := {stiffness};
    hessian_seek;
    steps := 1;
    isotropic.modulus := {share}*{stiffness};
    wrinkling.modulus := (1 - {share})*{stiffness};
    newton;
"""


def elements(
    points: Any, triangles: Any, vertex: Callable[[int], str], edge: Callable[[int, int], str]
) -> str:
    """The vertices, edges and faces of a datafile, of film that is unstrained as it stands.

    Args:
        points: nodes (n, 3) [m].
        triangles: their nodes (m, 3).
        vertex: what to write behind a node.
        edge: what to write behind the edge of two nodes, the lower number first.
    """
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, edge_of = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    signed = np.where(pairs[:, 0] < pairs[:, 1], 1, -1) * (edge_of.ravel() + 1)
    u, v = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    gram = np.stack([(u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)], axis=-1)
    sides = zip(signed.reshape(-1, 3).tolist(), gram.tolist(), strict=True)
    return "\n".join(
        [
            "vertices",
            *(f"{k + 1} {x!r} {y!r} {z!r}{vertex(k)}" for k, (x, y, z) in enumerate(points.tolist())),
            "\nedges",
            *(f"{k} {a + 1} {b + 1}{edge(a, b)}" for k, (a, b) in enumerate(edges.tolist(), 1)),
            "\nfaces",
            *(
                f"{k} {a} {b} {c} form_factors {{{f!r}, {g!r}, {h!r}}}"
                for k, ((a, b, c), (f, g, h)) in enumerate(sides, 1)
            ),
        ]
    )


def _datafile(case: Case) -> str:
    mesh = film(case)
    held = set(mesh.bottom) | set(mesh.top)
    top = set(mesh.top)
    r = mesh.points[mesh.top]
    plate = np.cross(r, np.roll(r, -1, axis=0)).sum(axis=0)[2] / 2
    steps = (_WRINKLED if case.lift else _TAUT).format(
        stiffness=repr(STIFFNESS), stretch=1 + case.lift / mesh.points[mesh.top[0], 2], share=SHARE
    )
    film_of = elements(
        mesh.points,
        mesh.triangles,
        lambda k: f"{' fixed' if k in held else ''}{' on_top 1' if k in top else ''}",
        lambda a, b: "",
    )
    return f"""// the common problem, {case.name}, {case.divisions[0]} x {case.divisions[1]}
define vertex attribute on_top integer
define vertex attribute rest real[3]
define facet attribute poisson_ratio real
define facet attribute form_factors real[3]
quantity isotropic energy modulus 0 method linear_elastic global
quantity wrinkling energy modulus 0 method relaxed_elastic_A global

{film_of}

bodies
1

read
hessian_normal off
set facet tension 0
set facet poisson_ratio {NU}
set facet frontbody 1
set body pressure {PRESSURE}
foreach vertex vv do {{ vv.rest[1] := vv.x; vv.rest[2] := vv.y; vv.rest[3] := vv.z }}
steps := 0
newton := {{
    do {{
        old := total_energy;
        hessian_seek;
        steps += 1;
    }} while abs(total_energy - old) > 1e-8*abs(total_energy) and steps < 100;
}}
solve := {{{steps}}}
solve
hessian
steps += 1
largest := max(vertex, sqrt((x - rest[1])^2 + (y - rest[2])^2 + (z - rest[3])^2))
enclosed := body[1].volume + {float(plate)!r}*max(vertex where on_top, z)
printf "RESULT %.12f %.9g %g\\n", enclosed, largest, steps
q
q
"""
