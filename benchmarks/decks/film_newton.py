"""The common problem by Newton's method as it is in books: on one mesh, with a new tangent in each step.

Reads film.toml and writes result.json, as `lobefem inflate` does, which takes a shorter way.
"""

from __future__ import annotations

import json
from pathlib import Path

from lobefem import profiling

profile = profiling.start()

from lobefem import NewtonOptions, inflate  # noqa: E402  the imports are measured, too
from lobefem.io.design import Design  # noqa: E402

design = Design.load("film.toml")
balloon = design.balloon(design.surface())
state = inflate(balloon, design.pressure.value[0], options=NewtonOptions(keep_tangent=False))
result = {"profile": profile.as_dict()} | {
    name: getattr(state, name) for name in ("volume", "max_displacement", "iterations")
}
Path("result.json").write_text(json.dumps(result), encoding="utf-8")
