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
# Open MPI ends without a folder for its sessions, which a read-only container has there
if [ ! -w "${TMPDIR:-/tmp}" ] && [ -w /dev/shm ]; then
    export TMPDIR=/dev/shm
fi

if [ -n "${DISPLAY:-}" ] || ! command -v Xvfb >/dev/null; then
    exec "$@"
fi

# Not xvfb-run: it hangs as process 1 of a container and mixes stderr into stdout. The command takes this
# shell's place, since a shell heeds no signal before its child has ended. The server is in a session of
# its own, which no Ctrl-C reaches, with a guard that ends it within a second of the command's end.
# shellcheck disable=SC2016  # the guard's shell expands it
serve='
    Xvfb -displayfd 1 -screen 0 1280x1024x24 -nolisten tcp -noreset &
    exec >/dev/null 2>&1
    while kill -0 "$1" && kill -0 "$!"; do sleep 1; done
    kill "$!"; wait'
# It says its number last, or why there is none; by a pipe, since there may be no folder to write to.
said=$({ setsid sh -c "$serve" sh "$$" </dev/null 2>&1 & } |
    timeout --foreground 10 sed -u '/^[0-9][0-9]*$/q' | tail -n 1)
case $said in
'' | *[!0-9]*) echo "docker/entry.sh: Xvfb did not start, so pictures will fail: $said" >&2 ;;
*) export DISPLAY=":$said" ;;
esac
exec "$@"
