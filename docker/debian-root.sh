#!/bin/bash
# The reference stack without a container engine: the packages of docker/packages.txt and packages-dev.txt
# unpacked as a Debian 13 root in .debian/, and commands run inside it with this project mounted at its own
# path.
#
#   docker/debian-root.sh COMMAND [ARGUMENT...]   build the root if need be, run COMMAND inside
#   docker/debian-root.sh --build                 only build it
#   docker/debian-root.sh --remove                delete it
#
# Mounts live in a private mount namespace: they end with the command, so that deleting .debian can
# never reach through one. A plain user's root belongs to the user's subordinate ids.
set -euo pipefail

project=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
root=$project/.debian
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
authorities=usr/local/share/ca-certificates
packages=$(sed 's/#.*//' "$project"/docker/packages*.txt | xargs)
key="$(cksum <<<"$packages") $mirror"
PATH=$PATH:/usr/sbin:/sbin # chroot, which a plain user's path may lack

say() { echo "docker/debian-root.sh: $*" >&2; }
die() { say "$*"; exit 1; }

own_pids=() # mmdebstrap mounts a /proc, which a plain user may only for process ids of their own
as_root() { # root of a private mount namespace: ourselves, or a plain user over subordinate ids
    if [ "$(id -u)" -eq 0 ]; then
        unshare --mount --propagation private -- "$@"
    else
        unshare --user --map-root-user --map-auto --mount --propagation private "${own_pids[@]}" -- "$@"
    fi
}

check_namespaces() {
    if [ "$(id -u)" -ne 0 ] && ! command -v newuidmap >/dev/null; then
        die "a plain user's Debian root needs subordinate ids: install the package uidmap."
    fi
    as_root true 2>/dev/null ||
        die "this system refuses the mount namespace that the Debian root needs: run as root, or" \
            "give your user a line in /etc/subuid and /etc/subgid, or use docker/Dockerfile."
}

check_mmdebstrap() {
    if command -v mmdebstrap >/dev/null; then
        return
    fi
    if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
        die "mmdebstrap is missing: install it, on Debian by apt-get install mmdebstrap uidmap."
    fi
    say "installing mmdebstrap"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq || say "apt-get update failed in part; going on"
    apt-get install -y -qq --no-install-recommends mmdebstrap debian-archive-keyring >/dev/null ||
        die "apt-get could not install mmdebstrap (see above): install it by hand."
}

remove() {
    as_root rm -rf --one-file-system "$root"
}

build() {
    local proxy="" options certificates=(/usr/local/share/ca-certificates/*.crt)
    check_mmdebstrap
    remove
    say "unpacking Debian 13 with DOLFINx into .debian (3 GB, about two minutes)"
    options=(
        --mode=root --variant=minbase --quiet
        --include="${packages// /,}"
        --dpkgopt=force-unsafe-io
        --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/doc/*'
        --dpkgopt='path-exclude=/usr/share/locale/*'
    )
    own_pids=(--pid --fork --kill-child)
    eval "$(apt-config shell proxy Acquire::http::Proxy 2>/dev/null)"
    if [ -n "$proxy" ]; then
        options+=(--aptopt="Acquire::http::Proxy \"$proxy\"")
    fi
    as_root env DEBIAN_FRONTEND=noninteractive \
        mmdebstrap "${options[@]}" trixie "$root" "$mirror" >&2 ||
        die "mmdebstrap could not unpack Debian 13 from $mirror (see above): try DEBIAN_MIRROR=URL."
    own_pids=()
    if [ -e "${certificates[0]}" ]; then # the host's own authorities, for pip behind a proxy
        as_root cp -L "${certificates[@]}" "$root/$authorities/"
    fi
    as_root env PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot "$root" update-ca-certificates \
        >/dev/null 2>&1 || die "update-ca-certificates failed in .debian."
    as_root sh -c 'echo "$1" >"$2"' sh "$key" "$root/etc/lobefem-packages"
}

# Runs as root of the namespace: $1 root, $2 project, $3 pip's configuration or "", then a command.
# shellcheck disable=SC2016  # the inner shell expands it
readonly inside='
    root=$1 project=$2 config=$3; shift 3
    for file in /etc/resolv.conf /etc/hosts; do
        if [ -e "$file" ] && ! cmp -s "$file" "$root$file"; then
            rm -f "$root$file"; cp -L "$file" "$root$file"
        fi
    done
    for folder in /proc /sys /dev /tmp; do mount --rbind "$folder" "$root$folder"; done
    if [ -n "$config" ]; then
        touch "$root/etc/pip.conf"; mount --bind "$config" "$root/etc/pip.conf"
    fi
    mkdir -p "$root$project"; mount --bind "$project" "$root$project"
    exec "$@"'

run() {
    local name file config="" folder=$project
    local variables=(
        HOME=/root USER=root LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
        PIP_CERT=/etc/ssl/certs/ca-certificates.crt
        TMPDIR=/var/tmp # its own: MPI names folders after user 0, which in /tmp the real root may own
    )
    for name in $(compgen -e); do # of the caller's machine only proxies, pip and a few switches
        case $name in
        PIP_CERT) ;;
        http_proxy | https_proxy | no_proxy | all_proxy | PIP_* | HYPOTHESIS_* | PYTEST_* | TERM | CI | \
            HTTP_PROXY | HTTPS_PROXY | NO_PROXY | ALL_PROXY | OMP_NUM_THREADS | PYTHONUNBUFFERED | \
            PYTHONDONTWRITEBYTECODE) variables+=("$name=${!name}") ;;
        esac
    done
    for file in /etc/pip.conf "$HOME/.pip/pip.conf" "${XDG_CONFIG_HOME:-$HOME/.config}/pip/pip.conf"; do
        if [ -r "$file" ]; then
            config=$file
        fi
    done
    if [[ $PWD/ == "$project"/* ]]; then
        folder=$PWD
    fi
    # shellcheck disable=SC2016
    as_root sh -euc "$inside" sh "$root" "$project" "$config" \
        chroot "$root" /usr/bin/env -i "${variables[@]}" \
        sh -euc 'cd "$1"; shift; exec "$@"' sh "$folder" "$project/docker/entry.sh" "$@"
}

if [ $# -eq 0 ]; then
    die "which command? See the head of this script."
fi
if [ "$1" = --remove ] && [ ! -e "$root" ]; then
    exit 0
fi
check_namespaces
if [ "$1" = --remove ]; then
    remove
    exit 0
fi
(
    flock 9 # two makes at once build one root
    if ! as_root grep -qsxF "$key" "$root/etc/lobefem-packages"; then
        build
    fi
) 9>>"$project/.debian.lock"
if [ "$1" != --build ]; then
    run "$@"
fi
