"""The run folder: what is written can be read back, by ParaView's reader and by us."""

import importlib.util
import json
import os
import stat
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import pyvista

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import InputError
from lobefem.files import check_file, replace, replacing, save_json, to_json
from lobefem.io.checkpoints import load_state, save_state
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.stability.modes import find_modes

PRESSURE = 5.0


def small(**changes):
    design = Design().with_overrides(
        {"mesh.divisions": "4x8", "shape.lobes": 2, "hoops.enabled": True}
        | {key.replace("_", ".", 1): value for key, value in changes.items()}
    )
    return design.balloon(design.surface())


def read_fields(comm, folder):
    """Rank 0 reads as ParaView does: times, and each step's points, cell types and arrays."""
    found = None
    if comm.rank == 0:
        by_vtk = importlib.util.find_spec("vtkmodules.vtkIOXdmf2") is not None
        found = read_with_vtk(folder) if by_vtk else read_with_h5py(folder)
    return comm.bcast(found, root=0)


def read_with_vtk(folder):
    reader = pyvista.get_reader(str(folder / "fields.xdmf"))
    steps = []
    for time in reader.time_values:
        reader.set_active_time_value(time)
        grid = reader.read()
        arrays = {name: np.array(grid[name]) for name in grid.array_names}
        steps.append((np.array(grid.points), set(grid.celltypes), grid.n_cells, arrays))
    return list(reader.time_values), steps


def read_with_h5py(folder):
    """For Debian, whose VTK has no XDMF reader."""
    h5py = pytest.importorskip("h5py")
    vtk_types = {"Triangle": 5, "Quadrilateral": 9, "Triangle_6": 22, "Quadrilateral_9": 28}

    def data(part):
        item = part.find("DataItem")
        assert item.get("Precision") == "8" or item.get("NumberType") == "Int"
        name, path = item.text.strip().split(":")
        with h5py.File(folder / name) as file:
            array = file[path][()]
        assert list(array.shape) == [int(n) for n in item.get("Dimensions").split()]
        return array

    times, steps = [], []
    for grid in ElementTree.parse(folder / "fields.xdmf").getroot().iter("Grid"):
        if grid.get("GridType") != "Uniform":
            continue
        times.append(float(grid.find("Time").get("Value")))
        kind = vtk_types[grid.find("Topology").get("TopologyType")]
        arrays = {a.get("Name"): data(a) for a in grid.findall("Attribute")}
        count = len(data(grid.find("Topology")))
        steps.append((data(grid.find("Geometry")), {kind}, count, arrays))
    return times, steps


@pytest.mark.parametrize(
    ("cell", "order", "vtk_type", "points"),
    [
        ("triangle", 1, 5, 8 * 9),
        ("quadrilateral", 1, 9, 8 * 9),
        ("triangle", 2, 22, 16 * 17),
        ("quadrilateral", 2, 28, 16 * 17),
    ],
)
def test_paraview_reads_every_kind_of_mesh(comm, shared_path, cell, order, vtk_type, points):
    balloon = small(mesh_cell=cell, mesh_order=order)
    states = [ideal_state(balloon, p) for p in (500.0, 1000.0)]
    snapshots = [Snapshot(balloon, s.pressure, s, find_modes(s, 2).modes) for s in states]
    RunFolder(shared_path / "run", comm).save("", {}, snapshots)
    times, steps = read_fields(comm, shared_path / "run")
    assert times == [500.0, 1000.0]
    cells = 2 * 4 * 8 * (2 if cell == "triangle" else 1)
    for time, (x, types, count, arrays) in zip(times, steps, strict=True):
        assert (len(x), types, count) == (points, {vtk_type}, cells)
        assert np.ptp(x[:, 2]) == pytest.approx(2 * balloon.surface.shape.height, rel=1e-14)
        assert set(np.unique(arrays["lobe"])) == {1, 2}
        assert np.abs(arrays["displacement"]).max() == 0.0
        # N_phi = p R0^2/(2 R), between its values at the equator and at the edge
        N = arrays["stress_resultants"]
        low = time * balloon.surface.shape.R0 / 2
        assert N[:, 0].min() > 0.99 * low
        assert N[:, 0].max() < 1.01 * low * balloon.surface.shape.R0 / 2.0
        assert np.abs(N[:, 1:]).max() < 1e-9 * low
        np.testing.assert_allclose(arrays["regions"], np.tile([0, 1, 0], (count, 1)))  # all wrinkled
        phi = arrays["mode_1"] + 1j * arrays.get("mode_1_imag", 0)
        assert np.sqrt((np.abs(phi) ** 2).sum(axis=1)).max() == pytest.approx(1.0, rel=1e-12)


def test_fields_are_those_of_the_nodes_that_they_lie_on(comm, shared_path):
    # the top plate's lift is the largest displacement, on the top rim, and straight up
    balloon = small(plates_support="fixed", plates_lift="4 mm", film_law="isotropic")
    state = inflate(balloon, PRESSURE)
    RunFolder(shared_path / "run", comm).save("", {}, [Snapshot(balloon, PRESSURE, state)])
    _, [(x, _, _, arrays)] = read_fields(comm, shared_path / "run")
    u = arrays["displacement"]
    top = x[:, 2] > x[:, 2].max() - 1e-9
    assert top.sum() == 8
    np.testing.assert_allclose(u[top], np.tile([0, 0, 0.004], (8, 1)), atol=1e-15)
    np.testing.assert_allclose(u[x[:, 2] < 1e-9], 0.0, atol=1e-15)
    assert 0 < np.abs(u[~top]).max() < 0.004


@pytest.mark.parametrize(("cell", "order"), [("triangle", 1), ("triangle", 2), ("quadrilateral", 2)])
def test_a_state_read_back_is_the_same_equilibrium(comm, shared_path, cell, order, monkeypatch):
    monkeypatch.setattr("lobefem.io.npz._BLOCK", 31)
    balloon = small(mesh_cell=cell, mesh_order=order)
    state = inflate(balloon, PRESSURE)
    assert state.iterations > 0
    path = shared_path / "state.npz"
    save_state(path, state)
    other = small(mesh_cell=cell, mesh_order=order)
    checkpoint = load_state(path, other)
    assert (checkpoint.pressure, checkpoint.prestress) == (PRESSURE, PRESSURE)
    np.testing.assert_array_equal(checkpoint.vector().array_r, state.unknowns)
    assert inflate(other, PRESSURE, start=checkpoint).iterations == 0


def test_the_kept_state_does_not_depend_on_the_ranks(comm, shared_path):
    # a bent mode of the stack: no symmetry that could hide a permutation
    balloon = small()
    save_state(shared_path / "all.npz", inflate(balloon, PRESSURE))
    if comm.rank == 0:
        file = np.load(shared_path / "all.npz")
        position = file["position"]
        assert position.shape == (8 * 9, 3)
        # the input runs ring by ring from the bottom: heights never fall
        rings = np.unique(np.round(position[:, 2], 9))
        assert len(rings) == 9
        moved = np.linalg.norm(file["displacement"], axis=1)
        bottom = np.isclose(position[:, 2], rings[0])
        assert moved[bottom].max() == 0.0
        assert moved[~bottom].max() > 1e-6


@pytest.mark.parametrize("changes", [{"mesh_divisions": "4x6"}, {"plates_support": "fixed"}])
def test_a_state_of_another_design_is_refused(shared_path, changes):
    path = shared_path / "state.npz"
    save_state(path, inflate(small(), PRESSURE))
    with pytest.raises(InputError, match=r"state\.npz' is a state of another mesh or support"):
        load_state(path, small(**changes))


def test_a_file_that_is_no_state_is_refused(comm, shared_path):
    path, balloon = shared_path / "state.npz", small()
    with pytest.raises(InputError, match=r"state\.npz': No such file or directory"):
        load_state(path, balloon)
    if comm.rank == 0:
        path.write_text("nothing")
    with pytest.raises(InputError, match=r"state\.npz' holds no state"):
        load_state(path, balloon)
    if comm.rank == 0:
        with path.open("wb") as stream:
            np.savez(stream, other=np.zeros(3))
    with pytest.raises(InputError, match=r"holds no state \('position'\)"):
        load_state(path, balloon)


# --- folders and files --------------------------------------------------------------------------


def test_a_folder_in_use_is_refused_unless_overwritten(comm, shared_path):
    path = shared_path / "a" / "run"
    RunFolder(path, comm).save("x = 1\n", {"a": 1}, [])
    with pytest.raises(InputError, match=r"run' is not empty; give another --out, or --overwrite"):
        RunFolder(path, comm)
    balloon = small()
    state = inflate(balloon, PRESSURE)
    RunFolder(path, comm, overwrite=True).save("y = 2\n", {}, [Snapshot(balloon, 5.0, state)])
    names = {"design.toml", "run.json", "results.json", "fields.xdmf", "fields.h5", "state.npz"}
    names |= {"stations.csv"}
    assert {p.name for p in path.iterdir()} == names
    assert (path / "design.toml").read_text() == "y = 2\n"
    comm.Barrier()
    # a later run that draws nothing leaves nothing of this one behind
    RunFolder(path, comm, overwrite=True).save("z = 3\n", {}, [])
    assert {p.name for p in path.iterdir()} == {"design.toml", "run.json", "results.json"}


def test_what_was_looked_for_stays_where_a_run_without_steps_replaces_another(comm, shared_path):
    path = shared_path / "run"
    RunFolder(path, comm).save("x = 1\n", {"a": 1}, [])
    with RunFolder(path, comm, overwrite=True) as folder:
        folder.begin("y = 2\n", {"command": "critical"}, {"lobefem": "0.1.0"})
        folder.save("y = 2\n", {"a": 2})
    run = json.loads((path / "run.json").read_text())
    about = {"study": {"command": "critical"}, "design": "y = 2\n", "versions": {"lobefem": "0.1.0"}}
    assert run == about | {"steps": {}}
    comm.Barrier()


def test_of_two_runs_into_one_folder_the_first_to_end_has_it(comm, shared_path):
    path = shared_path / "run"
    first, second = RunFolder(path, comm), RunFolder(path, comm)
    first.save("x = 1\n", {"a": 1}, [])
    with pytest.raises(InputError, match=r"another run has filled '.*run' meanwhile; give another --out"):
        second.save("y = 2\n", {"a": 2}, [])
    assert (path / "design.toml").read_text() == "x = 1\n"
    assert json.loads((path / "results.json").read_text())["a"] == 1
    comm.Barrier()
    first.save("x = 3\n", {"a": 3}, [])  # the run itself may save again
    assert (path / "design.toml").read_text() == "x = 3\n"


def test_nothing_is_made_before_there_is_something_to_write(comm, shared_path):
    RunFolder(shared_path / "run", comm)
    assert not (shared_path / "run").exists()


def test_places_that_cannot_be_written_to(comm, shared_path):
    file = shared_path / "file"
    if comm.rank == 0:
        file.write_text("")
    comm.Barrier()
    with pytest.raises(InputError, match=r"file' is a file, not a folder; give another --out"):
        RunFolder(file, comm)
    with pytest.raises(InputError, match=r"file' cannot be written to; give another place"):
        RunFolder(file / "run", comm)
    with pytest.raises(InputError, match=r"' is a folder; give a file to write"):
        check_file(shared_path, comm)
    with pytest.raises(InputError, match=r"none' cannot be written to; give another place"):
        check_file(shared_path / "none" / "x.json", comm)
    with pytest.raises(InputError, match=r"x\.json': No such file or directory; give another"):
        save_json(shared_path / "none" / "x.json", {}, comm)


def test_json_is_plain_and_finite():
    results = {
        "inf": np.inf,
        "nan": float("nan"),
        "number": np.float64(0.1),
        "count": np.int32(3),
        "list": (1.5, -np.inf),
        "nested": {"none": None, "flag": True, "text": "µ"},
    }
    assert json.loads(to_json(results)) == {
        "inf": None,
        "nan": None,
        "number": 0.1,
        "count": 3,
        "list": [1.5, None],
        "nested": {"none": None, "flag": True, "text": "µ"},
    }


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path):
    path = tmp_path / "file"
    replace(path, "old")

    def fail():
        with replacing(path) as stream:
            stream.write(b"half of the n")
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
    replace(path, "new")
    assert path.read_text() == "new"
    plain = tmp_path / "plain"
    plain.touch()
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_a_device_can_be_written_to_where_its_folder_cannot(comm, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) == "/dev/null")
    check_file("/dev/null", comm)
    with pytest.raises(InputError, match=r"'/dev/full' cannot be written to; give another file"):
        check_file("/dev/full", comm)


def test_a_link_is_followed_and_a_device_is_kept(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    replace(link, "new")
    assert (target.read_text(), link.is_symlink()) == ("new", True)
    null = tmp_path / "null"
    null.symlink_to("/dev/null")
    replace(null, "nothing")
    assert Path("/dev/null").is_char_device()


# --- runs that go on ----------------------------------------------------------------------------


def test_a_run_goes_on_from_what_it_kept(comm, shared_path):
    balloon = small()
    state = inflate(balloon, PRESSURE)
    folder = RunFolder(shared_path / "run", comm)
    folder.begin("[film]\n")
    assert folder.kept(balloon) is None
    folder.keep(state, {"parameter": 0.5, "history": [1.0, None, "x"]})
    again = RunFolder(shared_path / "run", comm, resume=True)
    again.begin("[film]\n")
    kept = again.kept(balloon)
    assert kept.notes == {"parameter": 0.5, "history": [1.0, None, "x"]}
    assert kept.pressure == PRESSURE
    np.testing.assert_array_equal(kept.unknowns, state.unknowns)


def test_only_a_run_of_the_same_design_goes_on(comm, shared_path):
    path = shared_path / "run"
    with pytest.raises(InputError, match=r"there is no run in '.*' to go on with; leave out --resume"):
        RunFolder(path, comm, resume=True)
    if comm.rank == 0:
        path.mkdir()
    comm.Barrier()
    with pytest.raises(InputError, match="holds no run to go on with"):
        RunFolder(path, comm, resume=True)
    RunFolder(path, comm).begin("[film]\n")
    with pytest.raises(InputError, match=r"is of another design; resume it with its own design.toml"):
        RunFolder(path, comm, resume=True).begin("[film]\nnu = 0.4\n")


def test_a_run_keeps_its_log(comm, shared_path):
    from lobefem.log import logger

    with RunFolder(shared_path / "run", comm) as folder:
        logger.info("before the folder is made")
        folder.begin("")
        logger.info("afterwards")
    logger.info("no part of the run")
    if comm.rank == 0:
        lines = (shared_path / "run" / "log.txt").read_text().splitlines()
        assert [line.split(" INFO ")[1] for line in lines] == ["before the folder is made", "afterwards"]
