"""Four lobes of tension-field film from ten thousand to a million unknowns, on one rank and on two.

    python -m benchmarks.scaling --out out/scaling

Each run is a process group of its own: mesh, set-up, equilibrium at 5 Pa, its ten lowest modes, then one
of each kind of work alone (residual, tangent, symbolic and numeric factorisation, triangular solves). Two
clocks: wall time, and CPU time of the busiest rank, which other work on the machine changes less; ranks
that wait do so busily, so on an idle machine the two agree. Memory is the sum of the ranks' peaks. Of runs
alike the one of least CPU time is kept, for what else the machine does only adds to it; after a change of
the code begin with another folder.

On one rank the tangent's linear system is solved in other ways besides: block low-rank factors, incomplete
factors and algebraic multigrid with the rigid motions as near null space, in conjugate gradients.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.scaling_report import write_report

MESHES = ((24, 32), (80, 104), (256, 328))
LOBES, PRESSURE, COUNT = 4, 5.0, 10

_DIRECT = "-pc_type cholesky -pc_factor_mat_solver_type mumps -mat_mumps_icntl_14 60"
_HOPELESS = 2e5  # unknowns beyond which incomplete factors and multigrid take minutes, or a thousand steps
SOLVERS = {
    "LDL^T (MUMPS)": f"-ksp_type preonly {_DIRECT}",
    "GMRES, block low-rank LDL^T": f"-ksp_type gmres {_DIRECT} -mat_mumps_icntl_35 2 -mat_mumps_cntl_7 1e-10",
    "CG, incomplete Cholesky of level 2": "-ksp_type cg -pc_type icc -pc_factor_levels 2 "
    "-pc_factor_shift_type positive_definite",
    "CG, incomplete Cholesky of level 6": "-ksp_type cg -pc_type icc -pc_factor_levels 6 "
    "-pc_factor_shift_type positive_definite",
    "CG, GAMG": "-ksp_type cg -pc_type gamg -mg_levels_pc_type jacobi",
}


def work(divisions: tuple[int, int], load: str, solvers: bool) -> dict[str, Any] | None:
    """One run on this communicator; its record on rank 0, None elsewhere. Collective."""
    from lobefem import profiling

    profile = profiling.start()
    with profiling.stage("import"):
        from lobefem import Balloon, EndPlates, GasPressure, Hoops, TensionField, lobed_cylinder
        from lobefem.equilibrium.inflation import inflate
        from lobefem.linalg import petsc
        from lobefem.stability.modes import find_modes

        # isort: split
        from mpi4py import MPI
        from petsc4py import PETSc
    comm = MPI.COMM_WORLD
    steps: dict[str, dict[str, float]] = {}

    def timed[T](name: str, task: Callable[[], T], repeat: int = 1) -> T:
        comm.Barrier()
        times = []
        for _ in range(repeat):
            wall, cpu = time.perf_counter(), time.process_time()
            result = task()
            times.append((time.perf_counter() - wall, time.process_time() - cpu))
        slowest = [comm.allreduce(min(values), op=MPI.MAX) for values in zip(*times, strict=True)]
        steps[name] = {"seconds": slowest[0], "cpu": slowest[1]}
        return result

    def calls() -> dict[str, int]:
        return {name: stage["calls"] for name, stage in profile.as_dict()["stages"].items()}

    start = time.process_time(), profile.as_dict()["whole"]
    surface = timed("mesh", lambda: lobed_cylinder(LOBES, divisions, comm=comm))
    parts = [GasPressure(load), Hoops(), EndPlates()]
    balloon = timed("set-up", lambda: Balloon(surface, TensionField(), parts))
    tangents, tangent = 0, balloon.tangent

    def counted(*args: Any, **kwargs: Any) -> Any:
        nonlocal tangents
        tangents += 1
        return tangent(*args, **kwargs)

    balloon.tangent = counted  # type: ignore[method-assign]  # of this mesh, not of coarser ones
    state = timed("inflate", lambda: inflate(balloon, PRESSURE, nested=True))
    inflated = calls()
    modes = timed("modes", lambda: find_modes(state, COUNT))
    whole = {"cpu": time.process_time(), "seconds": profile.as_dict()["whole"]}
    whole = {key: comm.allreduce(value, op=MPI.MAX) for key, value in whole.items()}
    memory = comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    done = calls()
    record: dict[str, Any] = {
        "divisions": divisions,
        "load": load,
        "ranks": comm.size,
        "unknowns": balloon.map.size,
        "whole": whole,
        "start": {"cpu": start[0], "seconds": start[1]},
        "memory": memory,
        "newton": state.iterations,
        "tangents": tangents,
        "factorisations": done[profiling.NUMERIC] - inflated[profiling.NUMERIC],
        "symbolic": 1 + done[profiling.SYMBOLIC] - inflated[profiling.SYMBOLIC],
        "solves": done[profiling.TRIANGULAR],
        "volume": state.volume,
        "lowest": [value.real for value in modes.values],
    }
    record["steps"], steps = steps, {}

    q = state.restore()
    out = q.duplicate()
    pressures = iter((1.02 * PRESSURE, 1.03 * PRESSURE, 1.01 * PRESSURE))

    def residual() -> None:
        balloon.set_loads(next(pressures))  # the same one twice would be remembered
        balloon.residual(q, out)

    timed("residual", residual, 3)
    K = balloon.tangent(q)
    timed("tangent", lambda: balloon.tangent(q), 3)
    x = out.duplicate()
    for name, compressed in (("compressed", True), ("numeric", False)):  # the latter's factors are looked at
        ksp = PETSc.KSP().create(comm)
        ksp.setOptionsPrefix(f"lobefem_{name}_")
        ksp.setOperators(K)
        petsc.set_direct_solver(ksp, load == "closed", compressed=compressed, inertia=not compressed)
        timed("symbolic", ksp.setUp)
        K.shift(0.0)  # the same matrix, as PETSc sees it a changed one
        K.assemble()
        ksp.setOperators(K)
        timed(name, ksp.setUp)
        for clock, value in steps[name].items():
            steps["symbolic"][clock] = max(steps["symbolic"][clock] - value, 0.0)
        timed("refined" if compressed else "solve", lambda ksp=ksp: ksp.solve(out, x), 3)
        if compressed:
            ksp.destroy()
    factors = ksp.getPC().getFactorMatrix()
    record["parts"] = steps
    if comm.size > 1:
        record["messages"] = _messages(comm)
    record["factors"] = {
        "entries": _mumps_count(factors.getMumpsInfog(29)),
        "flops": factors.getMumpsRinfog(3),
        "front": factors.getMumpsInfog(11),
        "on_busiest_rank": comm.allreduce(_mumps_count(factors.getMumpsInfo(27)), op=MPI.MAX),
    }
    ksp.destroy()
    if solvers:
        record["solvers"] = _solvers(balloon, K, out)
    return record if comm.rank == 0 else None


def _messages(comm: Any) -> dict[str, float]:
    """Latency [s] and bandwidth [B/s] between ranks 0 and 1: the best of many, for the machine is busy."""
    import numpy as np

    best = []
    for size, tries in ((8, 2000), (1 << 23, 20)):
        data, times = np.zeros(size // 8), []
        for _ in range(tries):
            start = time.perf_counter()
            for sender in (0, 1):
                if comm.rank == sender:
                    comm.Send(data, 1 - sender)
                elif comm.rank == 1 - sender:
                    comm.Recv(data, sender)
            times.append((time.perf_counter() - start) / 2)
        best.append(comm.bcast(min(times)))
    return {"latency": best[0], "bandwidth": (1 << 23) / best[1]}


def _mumps_count(value: int) -> float:
    """MUMPS's counts: a negative one is in millions."""
    return -1e6 * value if value < 0 else float(value)


def _solvers(balloon: Any, K: Any, right: Any) -> list[dict[str, Any]]:
    """The system of one Newton step by other solvers, to 1e-8 of the residual's preconditioned norm."""
    from petsc4py import PETSc

    x = balloon.V.tabulate_dof_coordinates() + balloon.u.x.array.reshape(-1, 3)
    K.setNearNullSpace(PETSc.NullSpace().create(vectors=balloon.map.rigid_motions(x)))
    database = PETSc.Options("lobefem_other_")
    rows = []
    for name, options in SOLVERS.items():
        if "mumps" not in options and balloon.map.size > _HOPELESS:
            continue
        words = options.split()
        chosen = {word[1:]: value for word, value in zip(words[::2], words[1::2], strict=True)}
        for key, value in chosen.items():
            database[key] = value
        ksp = PETSc.KSP().create(balloon.comm)
        ksp.setOptionsPrefix("lobefem_other_")
        ksp.setOperators(K)
        ksp.setTolerances(rtol=1e-8, max_it=1000)
        ksp.setFromOptions()
        solution, rest = right.duplicate(), right.duplicate()
        clock = [time.process_time()]
        ksp.setUp()
        clock.append(time.process_time())
        ksp.solve(right, solution)
        clock.append(time.process_time())
        K.mult(solution, rest)
        rest.axpy(-1.0, right)
        rows.append(
            {
                "solver": name,
                "options": options,
                "setup": clock[1] - clock[0],
                "solve": clock[2] - clock[1],
                "iterations": ksp.getIterationNumber(),
                "converged": ksp.getConvergedReason() > 0,
                "residual": rest.norm() / right.norm(),
            }
        )
        ksp.destroy()
        for key in chosen:
            database.delValue(key)
    return rows


def run(divisions: tuple[int, int], load: str, ranks: int, solvers: bool, limit: float) -> dict[str, Any]:
    """One run in processes of its own."""
    with tempfile.TemporaryDirectory(prefix="lobefem-scaling-") as folder:
        file = Path(folder) / "record.json"
        command = [sys.executable, "-m", "benchmarks.scaling", "--work", str(file), "--load", load]
        command += ["--meshes", "{}x{}".format(*divisions)] + (["--solvers"] if solvers else [])
        if ranks > 1:
            beside = Path(sys.executable).with_name("mpirun")  # the stack's own comes first
            mpirun = str(beside) if beside.exists() else shutil.which("mpirun")
            if mpirun is None:
                raise SystemExit("there is no mpirun; leave it at --ranks 1")
            command = [mpirun, "-n", str(ranks), *command]
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        busy = os.getloadavg()[0]
        subprocess.run(command, env=environment, check=True, timeout=limit)
        return json.loads(file.read_text(encoding="utf-8")) | {"busy": busy}


def with_fastest(records: list[dict[str, Any]], record: dict[str, Any]) -> list[dict[str, Any]]:
    """The records with a further one, of those alike the one of least CPU time."""
    alike = [r for r in records if all(r[key] == record[key] for key in ("divisions", "load", "ranks"))]
    best = min([*alike, record], key=lambda r: r["whole"]["cpu"])
    for r in [*alike, record]:  # the comparison of solvers is not made in each run
        if "solvers" in r:
            best.setdefault("solvers", r["solvers"])
    return [*(r for r in records if r not in alike), best]


def main() -> None:
    """Run all meshes and write scaling.json, scaling.md and scaling.png."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/scaling"), help="folder for the results")
    parser.add_argument("--meshes", nargs="+", default=["{}x{}".format(*m) for m in MESHES])
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--load", choices=("closed", "film"), default="closed")
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds for one run")
    parser.add_argument("--solvers", action="store_true", help="other solvers, too, on one rank")
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    meshes = [tuple(map(int, text.split("x"))) for text in given.meshes]
    if given.work is not None:
        record = work(meshes[0], given.load, given.solvers)
        if record is not None:
            given.work.write_text(json.dumps(record), encoding="utf-8")
        return
    given.out.mkdir(parents=True, exist_ok=True)
    file = given.out / "scaling.json"
    records = json.loads(file.read_text(encoding="utf-8")) if file.exists() else []
    for divisions in meshes:
        for ranks in given.ranks:
            record = run(divisions, given.load, ranks, given.solvers and ranks == 1, given.limit)
            records = with_fastest(records, record)
            said = "{unknowns} unknowns, {ranks} rank(s): {memory:.0f} MB".format(**record)
            print(
                f"{said}, {record['whole']['seconds']:.1f} s, CPU {record['whole']['cpu']:.1f} s", flush=True
            )
            records.sort(key=lambda r: (r["load"], r["unknowns"], r["ranks"]))
            file.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
    write_report(given.out, records)
    print((given.out / "scaling.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
