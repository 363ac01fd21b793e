#!/bin/sh
# setup.sh VENV [EXTRA]: make VENV/bin/lobefem work, quickly when it already does; with what an extra of
# pyproject.toml names, `dev` if none is named, none if it is "".
#
# Two kinds of environment, as find-python.sh decides: `system` sees the DOLFINx of its Python and
# adds only what that lacks; `wheel` brings its own DOLFINx, PETSc, SLEPc and MPI from PyPI. The file
# VENV/lobefem-setup is written last: without it the environment is half-made and made afresh.
set -eu

die() { echo "$*" >&2; exit 1; }
apt() { # install packages where that is ours to do: as root of a Debian
    [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null || return 1
    echo "setup: apt-get install $*"
    { apt-get update -qq || true; } 2>&1
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null 2>&1
}

cd "$(dirname "$0")/.."
[ $# -eq 1 ] || [ $# -eq 2 ] || die "usage: docker/setup.sh VENV [EXTRA]"
case $1 in
/*) venv=$1 ;;
*) venv=$(pwd -P)/$1 ;;
esac
stamp=$venv/lobefem-setup
extra=${2-dev}
# Of pyproject.toml what comes before the first tool's settings but setuptools'.
key="$(sed '/^\[tool\.[^s]/,$d' pyproject.toml | cat - docker/setup.sh docker/missing.py | cksum)"
key="$key $venv ${PYTHON:-} ${KIND:-} $extra"

if [ "$(sed -n 2p "$stamp" 2>/dev/null)" = "$key" ] && "$venv/bin/python" -c '' 2>/dev/null; then
    exit 0
fi
compiles() { echo '#include <math.h>' | ${CC:-cc} -E -x c - >/dev/null 2>&1; }
compiles || { apt gcc libc6-dev && compiles; } ||
    die "Install a C compiler (Debian: apt-get install gcc libc6-dev): finite-element forms are" \
        "compiled at run time."
found=$(docker/find-python.sh 2>/dev/null) ||
    { [ -e /usr/bin/python3.13 ] && apt python3-venv python3-dev >&2; } # Debian 13 splits them off
found=${found:-$(docker/find-python.sh)} || exit 1
kind=${found%% *} python=${found#* }

if [ -e "$venv" ] && [ ! -e "$venv/pyvenv.cfg" ] && [ ! -e "$venv/lobefem-making" ]; then
    rmdir "$venv" 2>/dev/null || die "$venv exists and is no virtual environment: move it away."
fi
echo "setup: $venv from $python ($kind stack)"
rm -rf "$venv"
mkdir -p "$venv"
touch "$venv/lobefem-making"
pip="$venv/bin/python -m pip --disable-pip-version-check --quiet"
if [ "$kind" = system ]; then
    "$python" -m venv --system-site-packages "$venv"
    # The system's versions stay: no dependency of theirs is fetched again (Debian's vtk, say, is
    # invisible to pip), and what is added must fit them.
    "$venv/bin/python" docker/missing.py "$venv/constraints.txt" "$extra" >"$venv/missing.txt"
    if [ -s "$venv/missing.txt" ]; then
        $pip install -c "$venv/constraints.txt" -r "$venv/missing.txt"
    fi
    $pip install --no-deps -e .
else
    "$python" -m venv "$venv"
    $pip install -e ".[wheel${extra:+,$extra}]"
    # PyPI's Gmsh and VTK lean on the system's X11 and OpenGL libraries.
    gmsh="libgl1 libglu1-mesa libgomp1 libxcursor1 libxft2 libfontconfig1 libxinerama1 libxrender1 libxfixes3 libxext6"
    opengl="libegl1 libgl1-mesa-dri"
    loads() { "$venv/bin/python" -c "$1" >/dev/null 2>&1; }
    loads 'import gmsh' || { apt $gmsh && loads 'import gmsh'; } ||
        die "Gmsh lacks system libraries: install them (Debian: apt-get install $gmsh)."
    egl='import ctypes; ctypes.CDLL("libEGL.so.1")'
    loads "$egl" || { apt $opengl && loads "$egl"; } ||
        echo "Pictures will fail for want of OpenGL: install it (Debian: apt-get install $opengl)." >&2
fi
"$venv/bin/lobefem" --help >/dev/null || die "$venv/bin/lobefem does not run: see above."
printf '%s\n%s\n' "$kind" "$key" >"$stamp"
rm "$venv/lobefem-making"
