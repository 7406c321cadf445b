#!/bin/sh
# Installs the packages of `make deb` into a fresh Debian 12 in a folder, does the demo there, and removes them again.
# Fails when anything but the demo's own folder stays behind. Needs root, mmdebstrap and a Debian mirror.
set -eu
debs=$(cd "${1:-build-deb}" && pwd)
work=$(mktemp -d)
root=$work/root
trap 'umount "$root/proc" 2>/dev/null || :; rm -rf "$work"' EXIT
in_root() {
    chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
        DEBIAN_FRONTEND=noninteractive "$@"
}
quietly() { "$@" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }; }
install_all() { quietly in_root sh -c 'apt-get install -y --no-install-recommends /debs/*.deb'; }
purge_all() { quietly in_root apt-get purge -y nacre nacred nacre-view nacre-doc; }
# Files, and what is not a cache of Mesa's or lttng's (which libcamera brings).
list() { (cd "$root" && find . -xdev \
    \( -path ./proc -o -path ./root/demo -o -path ./root/.cache/mesa_shader_cache -o -path './dev/shm/lttng*' \
    -o -path ./var/log -o -path ./var/cache \) -prune -o ! -type d -print | sort); }

echo "a fresh Debian 12"
quietly mmdebstrap --variant=minbase bookworm "$root"
[ -s "$root/etc/resolv.conf" ] || cp /etc/resolv.conf "$root/etc/resolv.conf"
quietly in_root apt-get update
mkdir "$root/debs"
cp "$debs"/*.deb "$root/debs"
mount -t proc proc "$root/proc"

echo "install, purge: what stays"
install_all
purge_all
list >"$work/unused"
! grep -i nacre "$work/unused" | grep -v '^./debs/'

echo "install, demo"
install_all
in_root nacre --version
in_root sh -c 'mkdir /root/demo && cd /root/demo && nacre demo --quiet && nacre doctor'
in_root sh -c 'cd /root/demo && test -s demo-out/report.html && nacre session verify demo-out/session'

echo "purge: what use left behind, the demo's folder apart"
in_root sh -c 'sleep 6' # a nacred that nobody talks to ends after 5 s
purge_all
list >"$work/used"
diff "$work/unused" "$work/used" && echo "nothing"
