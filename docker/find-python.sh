#!/bin/sh
# Print "system PATH" for a Python in which DOLFINx >= 0.9 (real PETSc, SLEPc, Gmsh) imports, else
# "wheel PATH" for a Python >= 3.12 that can make a virtual environment and compile against its own
# headers; else say in one sentence what to install. PYTHON=PATH in the environment decides alone,
# and KIND=system or KIND=wheel allows one kind only.
set -u

candidates() { # one path a line, the likeliest first
    if [ -n "${PYTHON:-}" ]; then
        command -v "$PYTHON"
        return
    fi
    command -v python3
    ls /usr/bin/python3 2>/dev/null
    pyenv=$(command -v pyenv) # may serve a user other than the one whose home it is in
    for version in 3.12 3.13 3.14; do
        command -v "python$version"
        for versions in "${PYENV_ROOT:-/nowhere}/versions" "${HOME:-/nowhere}/.pyenv/versions" \
            "${pyenv%/*/*}/versions" /opt/pyenv/versions "${HOME:-/nowhere}/.local/share/uv/python"; do
            ls "$versions/"*"$version"*/bin/python3 2>/dev/null
        done
    done
}

# Both print the interpreter, pyenv's shim resolved. A virtual environment's DOLFINx does not count:
# an environment made from it would not see it.
has_dolfinx='
import os, sys
assert sys.version_info >= (3, 12) and sys.prefix == sys.base_prefix
sys.stdout.flush(); output = os.dup(1); os.dup2(2, 1)  # libraries print at import
import dolfinx, dolfinx.fem.petsc, gmsh, slepc4py.SLEPc
from petsc4py import PETSc
import numpy
assert tuple(int(n) for n in dolfinx.__version__.split(".")[:2]) >= (0, 9)
assert not issubclass(PETSc.ScalarType, numpy.complexfloating)
import ensurepip, venv
os.write(output, sys.executable.encode())
'
can_make_venv='
import sys
assert (3, 12) <= sys.version_info < (3, 15)
import ctypes, ensurepip, os, ssl, sysconfig, venv
assert os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h"))
print(sys.executable)
'

try() { # run code $2 in $1 (pyenv's shims exist for unselected versions too, and fail); in "/", so
    # that nothing here shadows a module
    (cd / && timeout 120 "$1" -c "$2" 2>/dev/null)
}

for code in has_dolfinx can_make_venv; do
    case $code in
    has_dolfinx) kind=system test=$has_dolfinx ;;
    *) kind=wheel test=$can_make_venv ;;
    esac
    if [ "${KIND:-$kind}" != "$kind" ]; then
        continue
    fi
    if [ "$kind" = wheel ] && [ "$(uname -sm)" != "Linux x86_64" ]; then
        echo "Install DOLFINx >= 0.9 with real PETSc, SLEPc and Gmsh for your Python (Debian 13:" \
            "apt-get install python3-dolfinx-real python3-gmsh python3-venv), since there is no" \
            "wheel of it for $(uname -sm)." >&2
        exit 1
    fi
    for candidate in $(candidates); do
        if python=$(try "$candidate" "$test") && [ -n "$python" ]; then
            echo "$kind $python"
            exit 0
        fi
    done
done
if [ "${KIND:-}" = system ]; then
    echo "No Python here imports DOLFINx >= 0.9 with real PETSc, SLEPc and Gmsh: install the packages" \
        "of docker/packages.txt." >&2
elif [ -n "${PYTHON:-}" ]; then
    echo "PYTHON=$PYTHON is no Python >= 3.12 with venv and Python.h: choose another." >&2
else
    echo "Install a Python >= 3.12 with its headers (Debian 13: apt-get install python3-venv" \
        "python3-dev; Debian 12: pyenv install 3.12), or on Debian 13 DOLFINx itself" \
        "(python3-dolfinx-real python3-gmsh python3-venv)." >&2
fi
exit 1
