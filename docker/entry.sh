#!/bin/sh
# Run a command as lobefem wants it run: one thread a rank, Open MPI that also starts as root and on
# fewer cores than ranks, and an X server for Debian's VTK, which draws nothing without one.
# The container's entry point; docker/debian-root.sh and the Makefile use it too.
set -u

export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"
export MPLBACKEND="${MPLBACKEND:-Agg}"
# Open MPI 4 reads OMPI_MCA_*, Open MPI 5 reads PRTE_MCA_* ; MPICH reads neither.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none
if [ -z "${PMIX_RANK:-}${PMI_RANK:-}" ]; then
    # not one of a launcher's ranks, so all is on this machine: shared memory, no complaints about its
    # network and no second spent on looking for fabrics
    export OMPI_MCA_btl="${OMPI_MCA_btl:-^tcp,ofi}"
fi
export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
export PRTE_MCA_hwloc_default_binding_policy=none

if [ -n "${DISPLAY:-}" ] || ! command -v Xvfb >/dev/null; then
    exec "$@"
fi

# Not xvfb-run: it hangs as process 1 of a container and mixes stderr into stdout.
scratch=$(mktemp -d)
Xvfb -displayfd 3 -screen 0 1280x1024x24 -nolisten tcp 3>"$scratch/display" 2>"$scratch/log" &
server=$!
trap 'kill "$server" 2>/dev/null; rm -rf "$scratch"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
tries=0
until [ -s "$scratch/display" ]; do
    tries=$((tries + 1))
    if [ "$tries" -gt 100 ] || ! kill -0 "$server" 2>/dev/null; then
        echo "docker/entry.sh: Xvfb did not start, so pictures will fail: $(tail -n 1 "$scratch/log")" >&2
        break
    fi
    sleep 0.1
done
if [ -s "$scratch/display" ]; then
    DISPLAY=":$(cat "$scratch/display")"
    export DISPLAY
fi
"$@"
