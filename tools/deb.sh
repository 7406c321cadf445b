#!/bin/sh
# Debian packages of what is committed, into build-deb/, and what lintian says of them.
set -eu
need=""
for p in debhelper lintian fakeroot; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null)" = installed ] || need="$need $p"
done
as_root=""
[ "$(id -u)" = 0 ] || as_root="sudo -n"
[ -z "$need" ] || DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -qq --no-install-recommends $need >/dev/null
rm -rf build-deb
mkdir -p build-deb/nacre
git archive HEAD | tar -x -C build-deb/nacre
(cd build-deb/nacre && dpkg-buildpackage -b -us -uc >../build.log 2>&1) || { tail -30 build-deb/build.log >&2; exit 1; }
rm -rf build-deb/nacre
lintian --fail-on error,warning build-deb/*.changes && echo "lintian: clean"
ls -l build-deb/*.deb
