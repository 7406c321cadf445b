#!/bin/sh
# fetch.sh FOLDER - makes a guest in FOLDER: Debian's kernel, four modules that Debian leaves out,
# and the programs that start and test it. Packages are downloaded and unpacked, never installed.
# Exit 77 when they cannot be had.
set -eu
mkdir -p "$1/debs" "$1/tree/usr/bin" "$1/tree/usr/sbin" "$1/tree/usr/lib" "$1/modules"
dir=$(cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
tree=$dir/tree
made_by=$(cat "$0" "$here/init" | cksum)
[ "$(cat "$dir/ready" 2>/dev/null)" = "$made_by" ] && exit 0
gone() { echo "check-vm: skipped: $*" >&2; exit 77; }

programs="qemu-system-x86 busybox-static kmod cpio v4l-utils udev libcamera-ipa"
command -v apt-get >/dev/null || gone "no apt-get here"
image=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-6\.1[^ ]*\)$/\1/p' | head -1)
[ -n "$image" ] || gone "apt knows no linux-image-amd64 of version 6.1"
release=${image#linux-image-}
flavour=${release%-amd64}
missing=$(apt-get install --simulate --no-install-recommends $programs 2>/dev/null | sed -n 's/^Inst \([^ ]*\).*/\1/p')
for p in $programs; do
    case " $(echo $missing) " in *" $p "*) ;; *) dpkg -s "$p" >/dev/null 2>&1 || gone "apt has no $p" ;; esac
done
(cd "$dir/debs" && apt-get -qq download $missing "$image" "linux-headers-$release" \
    "linux-headers-$flavour-common" linux-kbuild-6.1 linux-source-6.1 >/dev/null 2>"$dir/log") ||
    gone "packages cannot be downloaded: $(grep '^E:' "$dir/log" | head -1)"

# One tree with /bin, /sbin and /lib inside /usr, as on the machine below which it is laid.
for d in bin sbin lib; do [ -e "$tree/$d" ] || ln -s "usr/$d" "$tree/$d"; done
for deb in "$dir"/debs/*.deb; do
    case $deb in
    */linux-source*) dpkg-deb --fsys-tarfile "$deb" | tar -xO ./usr/src/linux-source-6.1.tar.xz |
        tar -xJ -C "$dir/modules" --strip-components=1 --wildcards '*/drivers/gpio/gpio-sim.c' \
            '*/drivers/gpio/gpiolib.h' '*/kernel/irq/irq_sim.c' '*/drivers/media/test-drivers/vimc/*' \
            '*/drivers/usb/gadget/legacy/raw_gadget.c' ;;
    *) dpkg-deb --fsys-tarfile "$deb" | tar -x --keep-directory-symlink -C "$tree" ;;
    esac
done

# gpio-sim, vimc and the raw gadget are part of the kernel's source, but not of Debian's kernel.
cd "$dir/modules"
cp drivers/gpio/gpio-sim.c drivers/gpio/gpiolib.h drivers/media/test-drivers/vimc/*.[ch] \
    drivers/usb/gadget/legacy/raw_gadget.c .
# irq_to_desc() is not exported to modules; generic_handle_irq() does the same.
{ sed 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' kernel/irq/irq_sim.c
  printf '#include <linux/module.h>\nMODULE_LICENSE("GPL");\n'; } >irq_sim.c
cat >Makefile <<'M'
obj-m := gpio-sim.o irq_sim.o vimc.o raw_gadget.o
vimc-y := $(patsubst $(src)/%.c,%.o,$(wildcard $(src)/vimc-*.c))
M
headers=$tree/usr/src/linux-headers-$release
sed -i "s#^include /usr/src#include $tree/usr/src#" "$headers/Makefile"
make -C "$headers" M="$dir/modules" modules >"$dir/log" 2>&1 ||
    gone "modules cannot be built (gcc-12 is needed): $(grep -i error "$dir/log" | head -1)"
mkdir -p "$tree/lib/modules/$release/extra"
cp ./*.ko "$tree/lib/modules/$release/extra"

export PATH="$dir/bin:$tree/usr/bin:$PATH" LD_LIBRARY_PATH="$tree/usr/lib/x86_64-linux-gnu"
mkdir -p "$dir/bin"
for p in depmod modprobe; do # the package's own links lead to /bin
    ln -sf "$(command -v kmod)" "$dir/bin/$p"
done
depmod -b "$tree" "$release" 2>/dev/null

# The kernel without its wrapping: to unpack it in an emulated machine takes seconds.
at=$(grep -abo "$(printf '\3757zXZ')" "$tree/boot/vmlinuz-$release" | head -1 | cut -d: -f1)
tail -c "+$((at + 1))" "$tree/boot/vmlinuz-$release" | xz -dc >"$dir/vmlinux" 2>/dev/null || true
[ -s "$dir/vmlinux" ] || gone "the kernel is not packed by xz"

# What runs first: loads what 9p needs, then lays the tree over this machine's root.
first=$dir/initrd
mkdir -p "$first/modules"
cp "$tree/usr/bin/busybox" "$first/busybox"
cp "$here/init" "$first/init"
for m in virtio_pci 9pnet_virtio 9p overlay; do
    modprobe -S "$release" -d "$tree" --show-depends "$m"
done | awk '$1 == "insmod" && !seen[$2]++ {print $2}' >"$dir/log"
n=100
while read -r module; do
    n=$((n + 1))
    cp "$module" "$first/modules/$n.ko"
done <"$dir/log"
(cd "$first" && find . | cpio --quiet -o -H newc | gzip -1) >"$dir/initrd.img"
echo "$made_by" >"$dir/ready"
