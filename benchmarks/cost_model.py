"""What a run costs on more ranks than were measured, from the measurements of `benchmarks.scaling`.

    python -m benchmarks.cost_model                      # benchmarks/results/scaling.json
    python -m benchmarks.cost_model --unknowns 1e8 --ranks 512 --latency 1e-6 --bandwidth 2.5e10

The parts, N unknowns on P ranks of like cores:

    assembly       a N/P; residual and tangent with its constraint map's product
    analysis       s N on one rank, whatever P: MUMPS orders the gathered graph there
    factorisation  F/(r P) + communication, F = c N^e flops; in Newton's method a measured share of that, for
                   factors are compressed there; for modes F1/r more, F1 = n^3/3 flops of the last front of
                   n ~ sqrt(N) rows, which one rank factorises for the sake of the inertia
    solve          2 L/(b P) + latency, L entries of the factor read forwards and backwards
    the rest       o N/P + log2(P) latencies for each scalar product; coarser meshes count here, too

r and b, the rates of arithmetic and of memory, are fitted on one rank; what a second rank loses of them by
the cores' shared memory and by imbalance is measured and kept for more. Communication of a factorisation
is that of its fronts, n^2 numbers and half as many a level further down; messages cost a latency each.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scaling_report import table

__all__ = ["Model", "check", "fit", "limits", "predictions"]

RESULTS = Path(__file__).parent / "results/scaling.json"
# a common interconnect of clusters; one machine's own memory is faster
LATENCY, BANDWIDTH = 2e-6, 1e10  # [s], [B/s]
CASES = ((1e6, 1), (1e6, 2), (1e6, 64), (1e7, 64), (1e8, 64), (1e8, 4096), (1e9, 4096))
# bytes an unknown of the gathered graph: 21 entries a row, half of them for symmetry, of two numbers each,
# and MUMPS's own copy
_GRAPH = 21 / 2 * 8 * 2
_DOTS = 3000  # scalar products of a run: line searches, sixty Lanczos steps orthogonalised twice, residuals


@dataclass(frozen=True)
class Model:
    """The fitted numbers.

    Attributes:
        assembly: seconds of one tangent and one residual an unknown.
        symbolic: seconds of an analysis an unknown.
        rest: seconds of all that is neither assembled nor factorised, an unknown.
        start: seconds before the mesh: interpreter and imports.
        flops: c and e of a factorisation's c N^e.
        front: rows of the largest front over sqrt(N).
        entries: of the factor over N log2(N).
        rate: flops a second of one core.
        compressed: time of compressed factors over that of exact ones.
        reading: entries of the factor a second of one core.
        losses: time of two ranks over half of that of one, of assembly, factorisation, solve and rest.
        memory: bytes a rank before the mesh, bytes an unknown without factors, bytes an entry of them.
        memory_loss: bytes of two ranks beyond `alone` over those of one.
        graph: bytes an unknown of the gathered graph on the rank that orders it.
        tangents, factorisations, symbolics, solves: how many a run needs; `factorisations` are those of
            the modes, Newton's method has one a tangent.
        latency: of a message [s].
        bandwidth: of messages [B/s].
    """

    assembly: float
    symbolic: float
    rest: float
    start: float
    flops: tuple[float, float]
    front: float
    entries: float
    rate: float
    compressed: float
    reading: float
    losses: dict[str, float]
    memory: tuple[float, float, float]
    memory_loss: float
    graph: float
    tangents: int
    factorisations: int
    symbolics: int
    solves: int
    latency: float
    bandwidth: float

    def run(self, N: float, P: int) -> dict[str, float]:
        """Seconds of each part of a run of N unknowns on P ranks, and bytes of the fullest rank."""
        lost = {part: 1 + (loss - 1) * min(math.log2(P), 1) for part, loss in self.losses.items()}
        levels = math.log2(P)
        front = self.front * math.sqrt(N)
        flops, last = self.flops[0] * N ** self.flops[1], front**3 / 3
        entries = self.entries * N * math.log2(N)
        message = self.latency * levels
        sent = 0.0 if P == 1 else 8 * front**2 * 2 / self.bandwidth + front / 64 * message
        shared = flops / P * lost["numeric"] / self.rate + sent
        proved = shared + last * (1 - 1 / P) / self.rate
        solve = 2 * entries / P / self.reading * lost["solve"] + 2 * math.log2(N) * message
        parts = {
            "start": self.start,
            "assembly": self.tangents * self.assembly * N / P * lost["assembly"],
            "analysis": self.symbolics * self.symbolic * N,
            "factorisation": self.factorisations * proved + (self.tangents - 1) * self.compressed * shared,
            "solves": self.solves * solve,
            "rest": self.rest * N / P * lost["rest"] + _DOTS * message,
        }
        parts["whole"] = sum(parts.values())
        alone, unknown, entry = self.memory
        parts["memory"] = alone + (unknown * N + entry * entries) / P * (self.memory_loss if P > 1 else 1)
        parts["rank 0"] = parts["memory"] + (self.graph * N if P > 1 else 0.0)
        return parts


def fit(
    records: list[dict[str, Any]],
    load: str = "closed",
    latency: float = LATENCY,
    bandwidth: float = BANDWIDTH,
) -> Model:
    """The model of measured records, on one rank and on two."""
    one, two = (
        sorted((r for r in records if r["load"] == load and r["ranks"] == P), key=lambda r: r["unknowns"])
        for P in (1, 2)
    )
    both = {r["unknowns"] for r in one} & {r["unknowns"] for r in two}
    one, two = ([r for r in of if r["unknowns"] in both] for of in (one, two))
    large, pair = one[-1], two[-1]
    N = large["unknowns"]
    sizes = np.array([r["unknowns"] for r in one])
    flops = np.array([r["factors"]["flops"] for r in one])
    e, log_c = np.polyfit(np.log(sizes[-2:]), np.log(flops[-2:]), 1)

    def cpu(record: dict[str, Any], *names: str) -> float:
        return sum(record["parts"][name]["cpu"] for name in names)

    compressed = cpu(large, "compressed") / cpu(large, "numeric")

    def rest(record: dict[str, Any]) -> float:
        spent = record["whole"]["cpu"] - record["start"]["cpu"]
        spent -= record["tangents"] * cpu(record, "residual", "tangent")
        factorisations = record["factorisations"] + (record["tangents"] - 1) * compressed
        spent -= factorisations * cpu(record, "numeric") + record["solves"] * cpu(record, "solve")
        return max(spent - record["symbolic"] * cpu(record, "symbolic"), 0.0)

    def loss(first: float, second: float) -> float:
        return max(2 * second / first, 1.0)

    # memory = alone + unknown N + entry L, its least squares with numbers that cannot be negative
    from scipy.optimize import nnls

    table = np.array([[1.0, r["unknowns"], r["factors"]["entries"]] for r in one])
    scale = table[-1]
    memory = nnls(table / scale, np.array([r["memory"] * 2**20 for r in one]))[0] / scale
    beyond = [r["memory"] * 2**20 - r["ranks"] * memory[0] for r in (large, pair)]
    return Model(
        assembly=cpu(large, "residual", "tangent") / N,
        symbolic=cpu(large, "symbolic") / N,
        rest=rest(large) / N,
        start=large["start"]["cpu"],
        flops=(float(np.exp(log_c)), float(e)),
        front=large["factors"]["front"] / math.sqrt(N),
        entries=large["factors"]["entries"] / (N * math.log2(N)),
        rate=large["factors"]["flops"] / cpu(large, "numeric"),
        compressed=compressed,
        reading=2 * large["factors"]["entries"] / cpu(large, "solve"),
        losses={
            "assembly": loss(cpu(large, "residual", "tangent"), cpu(pair, "residual", "tangent")),
            "numeric": loss(cpu(large, "numeric"), cpu(pair, "numeric")),
            "solve": loss(cpu(large, "solve"), cpu(pair, "solve")),
            "rest": loss(rest(large), rest(pair)),
        },
        memory=tuple(memory),
        memory_loss=max(beyond[1] / beyond[0], 1.0),
        graph=_GRAPH,
        tangents=large["tangents"],
        factorisations=large["factorisations"],
        symbolics=large["symbolic"],
        solves=large["solves"],
        latency=latency,
        bandwidth=bandwidth,
    )


_COLUMNS = ("assembly", "analysis", "factorisation", "solves", "rest", "whole")


def predictions(model: Model, cases: tuple[tuple[float, int], ...] = CASES) -> str:
    """Runs on more ranks as a Markdown table."""
    head = ["unknowns", "ranks", *(f"{name} [s]" for name in _COLUMNS), "fullest rank [GB]", "rank 0 [GB]"]
    rows = []
    for N, P in cases:
        parts = model.run(N, P)
        row = [f"{N:.0e}", str(P), *(parts[name] for name in _COLUMNS)]
        rows.append([*row, parts["memory"] / 2**30, parts["rank 0"] / 2**30])
    return table(head, rows)


def check(model: Model, records: list[dict[str, Any]], load: str = "closed") -> str:
    """The model beside every measured run, as a Markdown table."""
    head = ["unknowns", "ranks", "measured [s]", "model [s]", "measured [GB]", "model [GB]"]
    rows = []
    for r in sorted(records, key=lambda r: (r["unknowns"], r["ranks"])):
        if r["load"] != load:
            continue
        parts = model.run(r["unknowns"], r["ranks"])
        memory = r["ranks"] * parts["memory"] / 2**30
        rows.append([str(r["unknowns"]), str(r["ranks"]), r["whole"]["cpu"], parts["whole"]])
        rows[-1] += [r["memory"] / 1024, memory]
    return table(head, rows)


def limits(model: Model) -> str:
    """Limits that are met first, as a Markdown list."""
    node = 2**30 * 256.0  # memory of a common node
    whole = model.run(1e9, 4096)
    last = (model.front * math.sqrt(1e9)) ** 3 / 3 / model.rate
    rows = model.front * math.sqrt(1e9)
    factor = 8 * model.entries * 1e9 * math.log2(1e9)
    seconds, graph = 1e6 * model.symbolic, 1e6 * model.graph / 2**30
    lines = [
        f"- **The analysis, on one rank.** {seconds:.1f} s and {graph:.2f} GB a million",
        "  unknowns, whatever the number of ranks. A node of 256 GB is full at",
        f"  {node / model.graph:.0e} unknowns, and the analysis takes {whole['analysis']:.0f} s of the",
        f"  {whole['whole']:.0f} s predicted for 1e9 unknowns on 4096 ranks.",
        f"- **The last front, on one rank.** It has {rows:.0f} rows at 1e9 unknowns and takes {last:.0f} s",
        "  per factorisation. MUMPS splits it among ranks if it can; this number is without.",
        f"- **The memory of the factors.** They take {factor / 2**40:.1f} TB at 1e9 unknowns, and the",
        f"  fullest of 4096 ranks has {whole['memory'] / 2**30:.1f} GB.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the fitted numbers, the check and the predictions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--load", choices=("closed", "film"), default="closed")
    parser.add_argument("--unknowns", type=float, help="of a run to predict")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--latency", type=float, default=LATENCY, help="of a message [s]")
    parser.add_argument("--bandwidth", type=float, default=BANDWIDTH, help="of messages [B/s]")
    given = parser.parse_args()
    records = json.loads(given.results.read_text(encoding="utf-8"))
    model = fit(records, given.load, given.latency, given.bandwidth)
    for name, value in vars(model).items():
        print(f"{name}: {value}")
    cases = CASES if given.unknowns is None else ((given.unknowns, given.ranks),)
    print("", check(model, records, given.load), predictions(model, cases), limits(model), sep="\n")


if __name__ == "__main__":
    main()
