"""Files to go on from are data: a damaged one is refused, and nothing in any is executed."""

import io
import pickle

import numpy as np
import pytest
from broken import SINGLE, cases, fault_of_sentence, run
from hypothesis import strategies as st

from lobefem.equilibrium.inflation import inflate
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.io.checkpoints import load_state, save_state
from lobefem.model.end_plates import EndPlates
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField

from mpi4py import MPI

ARRAYS = ("position", "displacement", "plate_parameters", "pressure", "prestress", "notes")
WRONG = [
    lambda old: np.zeros(0),
    lambda old: np.full(old.shape, np.nan) if old.dtype.kind == "f" else np.zeros(3),
    lambda old: np.full(old.shape, np.inf) if old.dtype.kind == "f" else np.array(7),
    lambda old: old[..., None],
    lambda old: np.zeros((2_000_000, 3)),
    lambda old: np.array(["x"]),
    lambda old: np.array("[" * 5000),
    lambda old: np.array("null"),
    lambda old: old.astype(complex) if old.dtype.kind == "f" else np.array(b"\xff"),
    lambda old: np.array([Trap()], dtype=object),
]
ran = []


class Trap:
    """What pickle would execute."""

    def __reduce__(self):
        return ran.append, ("executed",)


@pytest.fixture(scope="module")
def balloon():
    parts = [GasPressure("closed"), EndPlates("pinned")]
    return Balloon(lobed_cylinder(1, (4, 6)), TensionField(), parts)


@pytest.fixture(scope="module")
def kept(balloon, tmp_path_factory):
    """A state's file as bytes, on all ranks, and what load_state makes of it."""
    path = MPI.COMM_WORLD.bcast(tmp_path_factory.getbasetemp() / "sound.npz", root=0)
    save_state(path, inflate(balloon, 5.0), {"study": "x", "history": [1.0]})
    return path, path.read_bytes(), load_state(path, balloon)


def _npy():
    stream = io.BytesIO()
    np.save(stream, np.zeros(3))
    return stream.getvalue()


PLACE = st.integers(0, 2**32)
DAMAGES = st.one_of(
    st.tuples(st.just("bits"), st.lists(st.tuples(PLACE, st.integers(0, 7)), min_size=1, max_size=4)),
    st.tuples(st.just("cut"), PLACE),
    st.tuples(st.just("array"), st.tuples(st.sampled_from(ARRAYS), st.integers(0, len(WRONG) - 1))),
    st.tuples(st.just("lacking"), st.sampled_from(ARRAYS)),
    st.tuples(
        st.just("other"),
        st.one_of(st.binary(max_size=99), st.just(pickle.dumps(Trap())), st.just(_npy())),
    ),
    st.tuples(st.just("more"), st.sampled_from(["../../outside", "/outside", "field:x", "x"])),
)


def damage(content, kind, what):
    """A state's file, damaged as drawn."""
    if kind == "bits":
        damaged = bytearray(content)
        for place, bit in what:
            damaged[place % len(content)] ^= 1 << bit
        return bytes(damaged)
    if kind == "cut":
        return content[: what % len(content)]
    if kind == "other":
        return what
    with np.load(io.BytesIO(content)) as file:
        arrays = dict(file)
    if kind == "array":
        name, number = what
        arrays[name] = WRONG[number](arrays[name])
    elif kind == "lacking":
        del arrays[what]
    else:
        arrays[what] = np.zeros((30, 3))
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=True, **arrays)
    return stream.getvalue()


@cases(0.1, 25, damaged=DAMAGES)
def test_a_damaged_state_is_refused_or_the_same(balloon, kept, damaged):
    path, content, sound = kept
    comm, kind = balloon.comm, damaged[0]
    file = path.with_name("damaged.npz")
    if comm.rank == 0:
        file.write_bytes(damage(content, *damaged))
    comm.Barrier()
    try:
        found = load_state(file, balloon)
    except InputError as error:
        wrong = fault_of_sentence(" ".join(f"lobefem: {error}".split()) + "\n")
    else:
        same = found.pressure == sound.pressure and np.array_equal(found.unknowns, sound.unknowns)
        wrong = "" if same else "another state"
    assert not ran
    assert not any(comm.allgather(wrong)), f"{wrong} after {kind}"
    assert not (path.parent / "outside.npy").exists()


def test_a_run_with_damaged_files_is_refused_in_one_sentence(shared_path, comm):
    """Each file that --resume reads, cut off, empty, or of other contents."""
    folder = shared_path / "run"
    arguments = ["perturb", SINGLE, "--divisions", "4x6", "--film", "tension-field", "--pressure", "5",
                 "--bend", "2", "--steps", "2", "--no-contact", "--json", shared_path / "x.json",
                 "--out", folder]  # fmt: skip
    assert run(arguments)[0] == 0
    for name in ("run.json", "checkpoint.npz"):
        content = (folder / name).read_bytes() if comm.rank == 0 else None
        for damaged in (b"", (content or b"")[:-40], b"\xff\xfe\x00", b"[]", b'{"study": 1}', b"[" * 9000):
            if comm.rank == 0:
                (folder / name).write_bytes(damaged)
            comm.Barrier()
            code, out, err = run([*arguments, "--resume"])
            wrong = (fault_of_sentence(err) or out) if code == 2 else f"exit code {code}"
            wrong = comm.bcast(wrong, root=0)
            assert not wrong, f"{wrong}: {name} = {damaged[:40]}\n{err}"
        if comm.rank == 0:
            (folder / name).write_bytes(content)
        comm.Barrier()
    design = (folder / "design.toml").read_bytes()
    comm.Barrier()
    if comm.rank == 0:
        (folder / "design.toml").write_bytes(design[:-40])
    comm.Barrier()
    assert run([*arguments, "--resume"])[0] == 0
    assert (folder / "design.toml").read_bytes() == design  # run.json has it, too
