#!/bin/sh
# Installs the Debian packages that nacre needs to build, run and test, when any is missing.
# The one list of them; NACRE_NO_INSTALL=1 only says what is missing.
# --library, --cluster: what make library and make check-cluster need, too.
set -eu
packages="
build-essential cmake ninja-build pkg-config
libopenexr-dev libopencv-core-dev libopencv-imgproc-dev
libopencv-calib3d-dev libopencv-contrib-dev
libpng-dev libjpeg-dev libtiff-dev libraw-dev libexif-dev libzip-dev libexpat1-dev
libfftw3-dev liblapacke-dev libopenblas-dev
libyaml-dev libjansson-dev libsqlite3-dev libssl-dev
libegl-dev libgl-dev libegl1 libgl1-mesa-dri libepoxy-dev libcglm-dev
libgpiod-dev libusb-1.0-0-dev libcamera-dev
libglfw3-dev libimgui-dev fonts-dejavu-core xvfb
libcmocka-dev
"
case ${1:-} in
--library) packages="$packages snakemake" ;;
--cluster) packages="$packages snakemake slurmctld slurmd slurm-client munge" ;;
esac
missing=""
for p in $packages; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null)" = installed ] || missing="$missing $p"
done
[ -z "$missing" ] && exit 0
if [ -n "${NACRE_NO_INSTALL:-}" ] || ! command -v apt-get >/dev/null; then
    echo "nacre needs these Debian 12 packages:$missing" >&2
    exit 1
fi
as_root=""
if [ "$(id -u)" -ne 0 ]; then
    as_root="sudo -n"
    $as_root true 2>/dev/null || {
        echo "nacre needs packages that only root can install. Run:" >&2
        echo "  sudo apt-get install --no-install-recommends$missing" >&2
        exit 1
    }
fi
echo "installing:$missing" >&2
$as_root apt-get update -qq
DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -qq --no-install-recommends $missing >/dev/null
