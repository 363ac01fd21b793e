#!/bin/sh
# package.sh PYTHON [VERSION ...]: build sdist and wheel into build/dist, check them, and try the wheel in fresh
# environments: of PYTHON, and of python3.VERSION where there is such a one. The sdist's own quick tests run in the first.
set -eu

cd "$(dirname "$0")/.."
python=$(realpath -s "$1")
shift
dist=$(pwd -P)/build/dist work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pip="-m pip --disable-pip-version-check --quiet"

rm -rf "$dist" build/lib build/bdist.*
"$python" -m venv "$work/tools"
"$work/tools/bin/python" $pip install build twine
# A package's page shows the README away from its files: there its links are whole ones.
home=$(sed -n 's/^Homepage = "\(.*\)"/\1/p' pyproject.toml)
mkdir "$work/tree"
tar --create --exclude=./.git --exclude='./.venv*' --exclude='./.debian*' --exclude=./.peers --exclude=./out \
    --exclude=./build --exclude=__pycache__ --exclude='*.egg-info' . | tar --extract --directory "$work/tree"
sed -i -E -e "s,^(\\[[a-z]+\\]: )([A-Za-z/._]+\\.gif)$,\\1$home/raw/main/\\2," \
    -e "s,^(\\[[a-z]+\\]: )([A-Za-z/._]+\\.md)$,\\1$home/blob/main/\\2," "$work/tree/README.md"
"$work/tools/bin/python" -m build --outdir "$dist" "$work/tree" >"$work/build.log" 2>&1 ||
    { cat "$work/build.log"; exit 1; }
"$work/tools/bin/python" -m twine check --strict "$dist"/*
wheel=$(echo "$dist"/*.whl)

tried() { # PYTHON VENV: the wheel by itself, away from the source tree
    "$1" -m venv "$2"
    "$2/bin/python" $pip install "$wheel[wheel]"
    mkdir "$2/tried"
    (
        cd "$2/tried"
        unset PYTHONPATH
        "$2/bin/lobefem" --version
        "$2/bin/lobefem" new --list
        "$2/bin/lobefem" new stack4 >mine.toml
        "$2/bin/lobefem" new superpressure --out nasa
        "$2/bin/lobefem" critical mine.toml --film tension-field --state inflated --load closed \
            --divisions 6x10 --quiet --out run --report
        test -s run/report.html
        "$2/bin/lobefem" gores nasa/superpressure.toml --quiet --out gores
    )
}

# The versions of what a wheel needs from PyPI; the environment of Debian's packages tries the sdist alone.
if "$python" -c 'import dolfinx_solver' 2>/dev/null; then
    tried "$python" "$work/venv"
    own=$("$python" -c "import sys; print(\"%d.%d\" % sys.version_info[:2])")
    for version in "$@"; do
        [ "$version" != "$own" ] || continue
        other=$(command -v "python$version") && "$other" -c '' 2>/dev/null || continue
        tried "$other" "$work/venv$version"
    done
fi
mkdir "$work/sdist"
tar -xzf "$dist"/*.tar.gz -C "$work/sdist" --strip-components=1
cd "$work/sdist"
PYTHONPATH=$(pwd -P) "$python" -m pytest -q -p no:cacheprovider -m "not slow" \
    tests/unit/hallway tests/unit/io tests/demos/test_readme.py </dev/null
echo "the packages are in $dist"
