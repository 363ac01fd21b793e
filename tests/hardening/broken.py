"""Broken input of all kinds, and the one judge of what the command may do with it.

`LOBEFEM_EXAMPLES` says how many cases there are in all (`make harden`: ten thousand); without it
there are as few as an ordinary run of the suite can afford.
"""

import contextlib
import inspect
import io
import json
import math
import os
import re
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import typer
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lobefem.app import cli
from lobefem.io.design import Design

from mpi4py import MPI

MESHES = sorted((Path(__file__).parents[2] / "meshes").glob("*.toml"))
SINGLE = str(next(path for path in MESHES if path.stem == "single"))
EXAMPLES = int(os.environ.get("LOBEFEM_EXAMPLES", "0"))
KEYS = [
    (section, key)
    for section, field in Design.model_fields.items()
    for key in getattr(field.annotation, "model_fields", ())  # not those of lists of tables
]


def cases(share, least, **strategies):
    """Run a test with a share of all examples, at least so many, on all ranks alike.

    Rank 0 draws them: Hypothesis looks for constants in the modules that are loaded, which are others on
    other ranks. A fault on any rank is one on all.

    Args:
        share: of all examples.
        least: number of examples.
        strategies: by the test's arguments; what they draw is pickled.
    """
    comm = MPI.COMM_WORLD
    few = settings(
        max_examples=max(least, round(share * EXAMPLES)),
        deadline=None,
        database=None,
        derandomize=not EXAMPLES,
        suppress_health_check=list(HealthCheck),
    )

    def decorate(test):
        def one(fixtures, drawn):
            fault = None
            try:
                test(**fixtures, **drawn)
            except Exception as error:
                fault = error
            for others in comm.allgather(fault and f"{type(fault).__name__}: {fault}"):
                if others:
                    raise fault or AssertionError(others)

        def on_all_ranks(**fixtures):
            if comm.rank > 0:
                while (drawn := comm.bcast(None, root=0)) is not None:
                    with contextlib.suppress(Exception):  # rank 0 raises it
                        one(fixtures, drawn)
                assert not comm.bcast(None, root=0)
                return

            @few
            @given(**strategies)
            def drawing(**drawn):
                comm.bcast(drawn, root=0)
                one(fixtures, drawn)

            ended = False
            try:
                drawing()
                ended = True
            finally:
                comm.bcast(None, root=0)
                comm.bcast("" if ended else "rank 0 has found a fault", root=0)

        wanted = inspect.signature(test).parameters.values()
        on_all_ranks.__signature__ = inspect.Signature([p for p in wanted if p.name not in strategies])
        on_all_ranks.__name__, on_all_ranks.__doc__ = test.__name__, test.__doc__
        return on_all_ranks

    return decorate


# --- values -------------------------------------------------------------------------------------

DIGITS = "9" * 5000
WORDS = [
    "isotensoid", "cylinder", "formed", "triangle", "quadrilateral", "same", "alternating", "structured",
    "unstructured", "isotropic", "fixed-wrinkles", "tension-field", "imp", "load-path",
    "initial-stress", "consistent", "secant", "clamped", "pinned", "fixed", "film",
    "closed", "rigid", "none", "ideal", "inflated", "unit", "nodal",
]  # fmt: skip
NUMBERS = [
    "0", "-0.0", "1", "-1", "0.5", "2", "1e-15", "1e15", "1e308", "-1e308", "1e-308", "5e-324", "1e999",
    "nan", "inf", "-inf", "0.599", "0.6", "0.4999999", "4.2", "9" * 30, DIGITS, "1_0", "0x10", "+3",
]  # fmt: skip
UNITS = ["2 m", "5 kPa", "0.05 mm", "2 GN", "188 N/m", "-4 mm", "1e400 m", "5 furlongs", "m", "٣ m", "1e m"]
TEXTS = st.one_of(
    st.sampled_from([*WORDS, *NUMBERS, *UNITS, "4x6", "0x0", "x", "-4x6", "1000000x1000000", "9999x5000"]),
    st.text(max_size=8),
    st.floats().map(repr),
    st.integers().map(str),
)
TOML = st.one_of(
    st.sampled_from(
        [
            *NUMBERS, "true", "false", "[]", "[[]]", "{}", "{a = 1}", "[nan]", "[4, 6]", "[4, 6.0]",
            "[-4, 6]", "[1000000, 1000000]", "1979-05-27",
            "07:32:00", "1979-05-27T07:32:00Z", "'''a\nb'''", '"\\u0000"',
            '"\\u001b[31m"', "[" * 3000, "", "#", "=", "'",
        ]
    ),
    TEXTS.map(lambda text: json.dumps(text, ensure_ascii=False)),
    st.lists(st.sampled_from(NUMBERS), max_size=3).map(lambda numbers: f"[{', '.join(numbers)}]"),
)  # fmt: skip

# --- design files -------------------------------------------------------------------------------


@st.composite
def random_tables(draw):
    """A design file of its own: some keys, most of them known."""
    known = st.sampled_from(KEYS)
    names = st.one_of(
        known,
        known,
        known,
        st.tuples(st.sampled_from([s for s, _ in KEYS]), st.sampled_from(["x", '"a\\nb"', "E.E", '""'])),
        st.just(("fim", "E")),
        st.just(("film", "thickness" + ".a" * 1500)),
    )
    lines = []
    for (section, key), value in draw(st.lists(st.tuples(names, TOML), min_size=1, max_size=6)):
        lines.append(f"{section}.{key} = {value}")
    return "\n".join(lines).encode(errors="surrogatepass")


@st.composite
def mutated(draw):
    """A shipped design file with some lines or bytes changed."""
    lines = draw(st.sampled_from(MESHES)).read_text(encoding="utf-8").splitlines()
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, len(lines) - 1))
        key, equals, _ = lines[at].partition("=")
        change = draw(st.sampled_from(["value", "value", "value", "drop", "double", "swap", "key", "insert"]))
        if change == "value" and equals:
            lines[at] = f"{key}= {draw(TOML)}"
        elif change == "drop" and len(lines) > 1:
            del lines[at]
        elif change == "double":
            lines.insert(at, lines[at])
        elif change == "swap":
            lines[at], lines[-1] = lines[-1], lines[at]
        elif change == "key" and equals:
            lines[at] = f"{draw(st.sampled_from(KEYS))[1]} ={lines[at].partition('=')[2]}"
        elif change == "insert":
            lines.insert(
                at, draw(st.sampled_from(["[shape]", "[film]", "[", "\x00", "a", "\ufeff", "\u2028"]))
            )
    data = bytearray("\n".join(lines).encode(errors="surrogatepass"))
    for _ in range(draw(st.sampled_from([0, 0, 0, 1, 2, 8]))):
        if data:
            at = draw(st.integers(0, len(data) - 1))
            if draw(st.booleans()):
                data[at] ^= 1 << draw(st.integers(0, 7))
            else:
                del data[at:]
    return bytes(data)


@st.composite
def sweep_files(draw):
    """The demo's sweep with some lines or values changed, or tables of any kind."""
    lines = [
        f"command = {draw(st.one_of(st.just(chr(39) + 'critical' + chr(39)), TOML))}",
        f"design = {draw(st.one_of(st.sampled_from([repr(SINGLE), repr([SINGLE, SINGLE])]), TOML))}",
    ]
    for table in ("options", "vary"):
        names = st.one_of(
            st.sampled_from(["state", "limit", "film.E", "shape.lobes", "x", '"a.b"', "film"]),
            st.sampled_from(KEYS).map(".".join),
        )
        for _ in range(draw(st.integers(0, 3))):
            value = draw(TOML) if draw(st.booleans()) else f"[{draw(TOML)}, {draw(TOML)}]"
            lines.append(f"{table}.{draw(names)} = {value}")
    if draw(st.integers(0, 4)) == 0:
        del lines[draw(st.integers(0, len(lines) - 1))]
    return "\n".join(lines).encode(errors="surrogatepass")


SWEEP_FILES = st.one_of(sweep_files(), sweep_files(), random_tables(), st.binary(max_size=64))
DESIGN_FILES = st.one_of(random_tables(), mutated(), mutated(), st.binary(max_size=64))

# --- command lines ------------------------------------------------------------------------------

COMMANDS = ("inflate", "modes", "critical", "harmonics", "perturb")
PLAIN = {  # sound values, all of them of little work
    "--film": ["isotropic", "fixed-wrinkles", "tension-field", "imp", "load-path"],
    "--setup": ["initial-stress", "load-path"],
    "--load": ["film", "closed"],
    "--support": ["clamped", "pinned", "fixed"],
    "--lift": ["4 mm"],
    "--slack-stiffness": ["1e-4", "0"],
    "--divisions": ["4x6", "5x7"],
    "--cell": ["triangle", "quadrilateral"],
    "--order": ["1", "2"],
    "--lobes": ["1", "2"],
    "--edge-radius": ["2", "1 m"],
    "--pressure": ["5", "1 kPa"],
    "--count": ["1", "3"],
    "--state": ["ideal", "inflated"],
    "--mass": ["unit", "nodal"],
    "--harmonics": ["0:2", "1"],
    "--harmonic": ["0", "2"],
    "--limit": ["300"],
    "--meshes": ["4x14,6x14,8x14"],
    "--bend": ["2"],
    "--twist": ["1"],
    "--wave": ["2:0.01"],
    "--tip-displacement": ["0.05"],
    "--steps": ["2"],
    "--damping": ["1", "0.5"],
    "--petsc": ["-lobefem_inflate_snes_max_it 30"],
    "--out": ["OUT/new"],
    "--json": ["OUT/x.json"],
    "--what": ["modes", "stress", "state", "curves", "release"],
    "--to": ["OUT/a.png", "OUT/a.svg"],
    "--format": ["png", "svg"],
    "--mode": ["1", "1,2"],
    "--width": ["85", "170"],
}
TAKEN = {  # by each command
    name: {spelling for option in command.params for spelling in option.opts}
    for name, command in typer.main.get_command(cli.app).commands.items()
}
FLAGS = [
    "--prestress", "--no-prestress", "--mesh-study", "--release", "--no-contact", "--profile", "--overwrite",
    "--resume",
]  # fmt: skip
WILD = {  # by option, what it should refuse besides any text at all
    "--petsc": [
        "-lobefem_inflate_snes_type foo", "-lobefem_inflate_snes_max_it x", "-options_file none", "'", "-",
        "foo",
        "-lobefem_inflate_snes_max_it 0", "-lobefem_inflate_pc_type none", "-lobefem_inflate_ksp_type foo",
        "-lobefem_modes_eps_nev -3", "-lobefem_inflate_snes_linesearch_type foo",
    ],
    "--out": ["", "OUT", "OUT/full", "OUT/file", "OUT/file/x", "/dev/null", "/dev/null/x", "/proc/1/x",
              "\udcff", "OUT/" + "n" * 300, "OUT/a\nb", "OUT/\x1b[31m"],
    "--json": ["", "OUT", "OUT/none/x", "/dev/full", "/dev/null/x", "OUT/" + "n" * 300, "OUT/\udcff.json"],
    "--harmonics": ["0:999999", "5:2", "1:2:3", ",", "7"],
    "--meshes": ["999999x999999", "4x14", "4x14,4x14,4x14", "1x1,2x2,3x3", "x,x,x"],
    "--wave": ["2", ":", "2:nan", "999999:0.1", "2:1e9", "-1:2"],
    "--bend": ["90", "89.9", "1e300"],
    "--tip-displacement": ["100 km", "1e-300"],
    "--lobes": ["2000000", "100000"],
    "--to": ["", "OUT", "OUT/none/a.png", "OUT/a", "OUT/a.exe", "/dev/null/a.png", "OUT/full/other/a.png",
             "OUT/" + "n" * 300 + ".png", "OUT/a\nb.png"],
    "--format": ["exe", "PNG", "gif,png"],
    "--mode": ["0", "-1", "99", "1:", "1:999999999"],
    "--width": ["0", "1e9", "1e-9"],
    "--what": ["", "all"],
    "--steps": ["0", "1.5"],
}  # fmt: skip


@st.composite
def command_lines(draw):
    """A command with options of which most make sense; OUT stands for a folder of its own."""
    command = draw(st.sampled_from([*COMMANDS, *COMMANDS, "plot", "plot", "report", "", "--version", "-h"]))
    sound = "OUT/run" if command in ("plot", "report") else SINGLE
    line = [
        command,
        draw(st.sampled_from([sound] * 12 + ["OUT", "none.toml", "", "/dev/zero", "/dev/null"])),
    ]
    if command == "plot" and draw(st.integers(0, 9)):
        line += ["--what", draw(st.sampled_from(PLAIN["--what"]))]
    elif command != "plot" and draw(st.integers(0, 9)):
        line += ["--divisions", "4x6"]
    if command == "perturb" and draw(st.integers(0, 4)):
        line += ["--film", "tension-field", "--pressure", "5", "--steps", "2"]
        line += draw(st.sampled_from([["--bend", "2"], ["--tip-displacement", "0.05"]]))
    taken = [name for name in PLAIN if name in TAKEN.get(command, ())] or list(PLAIN)
    for _ in range(draw(st.integers(0, 4))):
        kind = draw(st.sampled_from(["plain", "plain", "plain", "flag", "wild", "wild", "text", "other"]))
        if kind == "flag":
            line.append(draw(st.sampled_from(FLAGS)))
        elif kind == "other":
            line.append(
                draw(st.one_of(st.sampled_from(["--", "-", "-x", "--presure", "x", "\udcff"]), TEXTS))
            )
        else:
            name = draw(st.sampled_from(taken))
            line.append(name)
            if kind == "plain":
                line.append(draw(st.sampled_from(PLAIN[name])))
            elif kind == "wild" and name in WILD:
                line.append(draw(st.sampled_from(WILD[name])))
            elif name not in ("--out", "--json", "--steps", "--to"):
                line.append(draw(TEXTS))
    return [word.replace("\x00", "") for word in line]  # what no process can be given


# --- the judge ----------------------------------------------------------------------------------


@contextmanager
def _captured(number, name):
    """What is written to a standard stream, by libraries in C as well."""
    stream = getattr(sys, name)
    stream.flush()
    kept = os.dup(number)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), number)
        errors = "strict" if number == 1 else "backslashreplace"
        text = io.TextIOWrapper(os.fdopen(number, "wb", closefd=False), encoding="utf-8", errors=errors)
        setattr(sys, name, text)
        found = []
        try:
            yield found
        finally:
            text.flush()
            setattr(sys, name, stream)
            os.dup2(kept, number)
            os.close(kept)
            file.seek(0)
            found.append(file.read().decode(errors="replace"))


def run(arguments):
    """Run a command in this process: its exit code, and what it wrote to stdout and to stderr."""
    with _captured(1, "stdout") as out, _captured(2, "stderr") as err:
        code = cli.main([str(word) for word in arguments])
    return code, out[0], err[0]


def fault_of_sentence(text):
    """What is wrong with what was said of bad input, '' if nothing is."""
    if not text.startswith("lobefem: "):
        return "does not begin with the program's name"
    if text.count("\n") != 1 or not text.endswith("\n"):
        return "is not one line"
    if not text[:-1].isprintable():
        return "holds control characters"
    if len(text) > 700:
        return "is too long"
    if "internal error" in text or "Traceback" in text:
        return "says 'internal error' or shows a traceback"
    return ""


def fault(code, out, err):
    """What is wrong with how a command ended, '' if nothing is."""
    if code == 0:
        return "" if "Traceback" not in err and "rror:" not in err else "ended well with an error on stderr"
    if code not in (2, 3):
        return f"exit code {code}"
    # a long run says every ten seconds how far it is
    besides = re.compile(r"lobefem: (warning: |\[\d+ s\] )")
    words = "".join(line + "\n" for line in err.split("\n") if line and not besides.match(line))
    wrong = fault_of_sentence(words)
    if wrong:
        return f"the sentence {wrong}"
    return "something on standard output besides" if out and code == 2 else ""


def leftovers(folder):
    """Files that a command should not have left behind."""
    return [path for path in folder.rglob("*") if path.name.startswith(".")]


def fault_of_results(results):
    """What is wrong with the results of a command that ended well, '' if nothing is."""
    if results.get("converged") is False:
        return "not converged"
    if results["command"] == "inflate":
        lacking = [key for key in ("volume", "max_displacement", "residual", "relative_residual", "taut_area",
                                   "wrinkled_area", "slack_area") if not _finite(results[key])]  # fmt: skip
        if lacking:
            return f"no finite {lacking}"
        if results["volume"] <= 0:
            return "a volume that is not positive"
    if results["command"] == "modes":
        for entry in results["pressures"]:
            for mode in entry["modes"]:
                if not all(_finite(mode[key]) for key in ("real", "imag", "residual")):
                    return "a mode that is no number"
                if mode["residual"] > 1e-4:
                    return f"a mode with the residual {mode['residual']}"
            if entry["stable"] != all(mode["real"] > 0 for mode in entry["modes"]):
                return "a verdict against its modes"
    if results["command"] == "critical" and results["critical_pressure"] is None and not results["reason"]:
        return "no critical pressure and no reason"
    if results["command"] == "perturb" and not all(
        _finite(results[key]) for key in ("volume_original", "volume_imposed", "volume_final", "reaction")
    ):
        return "a perturbation without numbers"
    return ""


def _finite(number):
    return number is not None and math.isfinite(number)
