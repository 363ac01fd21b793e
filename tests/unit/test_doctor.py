"""The doctor finds a sound installation sound, and says what to do about a broken one."""

import pytest

from lobefem import cli, doctor


def test_a_sound_installation(capfd, comm):
    assert cli.main(["doctor"]) == 0
    lines = [line for line in capfd.readouterr().out.splitlines() if line]
    if comm.rank == 0:
        assert [line[:2] for line in lines] == ["ok"] * len(doctor.CHECKS)
        assert any("DOLFINx 0." in line and "SLEPc 3." in line for line in lines)


def test_every_fault_is_said_with_its_remedy(monkeypatch, capfd, comm):
    def broken():
        raise OSError("libGL.so.1:\n  cannot open shared object file")

    checks = dict.fromkeys(doctor.CHECKS, (lambda: "1.0", "never said"))
    monkeypatch.setattr(doctor, "CHECKS", checks | {"Gmsh": (broken, "install Gmsh")})
    assert cli.main(["doctor"]) == 1
    out = capfd.readouterr().out
    if comm.rank == 0:
        assert "FAIL Gmsh" in out
        assert "libGL.so.1: cannot open shared object file" in out
        assert "-> install Gmsh" in out
        assert out.count("ok ") == len(checks) - 1
        assert "never said" not in out


@pytest.mark.parametrize("name", doctor.CHECKS)
def test_every_check_has_advice(name):
    check, advice = doctor.CHECKS[name]
    assert callable(check)
    assert len(advice) > 10
