#!/bin/sh
# install_peers.sh PYTHON: the other programs of the comparison, each into a place of its own in .peers.
#
# Surface Evolver and CalculiX are Debian's packages, unpacked with the libraries they lack: no root is
# needed and nothing of the system changes. NGSolve and Kratos are PyPI's, each in its own environment.
# What cannot be had is said and left out; the comparison then does without it.
set -u
cd "$(dirname "$0")/.." || exit 1
python=${1:-python3}
peers=$(pwd -P)/.peers
mkdir -p "$peers"

debian() {
    command -v apt-get >/dev/null && command -v dpkg >/dev/null ||
        { echo "Surface Evolver, CalculiX: no Debian here; install evolver and ccx yourself"; return; }
    wanted="evolver-nox calculix-ccx"
    rm -rf "$peers/debian" "$peers/packages"
    mkdir -p "$peers/debian" "$peers/packages"
    # shellcheck disable=SC2086
    needed=$(apt-get install -s --reinstall --no-install-recommends $wanted 2>/dev/null |
        sed -n 's/^Inst \([^ ]*\) .*/\1/p')
    # shellcheck disable=SC2086
    if [ -n "$needed" ] && (cd "$peers/packages" && apt-get download -qq $needed 2>/dev/null); then
        for package in "$peers"/packages/*.deb; do dpkg -x "$package" "$peers/debian"; done
        echo "Surface Evolver, CalculiX: in .peers/debian"
    else
        echo "Surface Evolver, CalculiX: Debian's packages $wanted cannot be fetched (apt-get update?)"
    fi
    rm -rf "$peers/packages"
}

pypi() { # NAME PACKAGE...
    name=$1
    shift
    rm -rf "${peers:?}/$name"
    if "$python" -m venv "$peers/$name" &&
        "$peers/$name/bin/python" -m pip --disable-pip-version-check --quiet install "$@"; then
        echo "$name: in .peers/$name"
    else
        rm -rf "${peers:?}/$name"
        echo "$name: PyPI has no $1 for this Python"
    fi
}

[ -x "$peers/debian/usr/bin/ccx" ] && [ -x "$peers/debian/usr/bin/evolver-nox-d" ] || debian
[ -x "$peers/ngsolve/bin/python" ] || pypi ngsolve ngsolve==6.2.2608
kratos=10.4.4
[ -x "$peers/kratos/bin/python" ] || pypi kratos KratosMultiphysics==$kratos \
    KratosStructuralMechanicsApplication==$kratos KratosLinearSolversApplication==$kratos \
    KratosConstitutiveLawsApplication==$kratos
