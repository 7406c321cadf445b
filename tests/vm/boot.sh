#!/bin/sh
# boot.sh FOLDER SECONDS COMMAND - runs COMMAND in the guest that fetch.sh made in FOLDER, on this
# machine's files, which it cannot change. Prints what it says; its exit status, or 125 when the
# guest ended without one.
set -eu
dir=$(cd "$1" && pwd)
tree=$dir/tree
job=$(mktemp -d)
trap 'rm -rf "$job"' EXIT
printf '%s\n' "$3" >"$job/run"
share() { # id, path, read-only?
    printf '%s ' -fsdev "local,id=$1,path=$2,security_model=none,multidevs=remap$3" \
        -device "virtio-9p-pci,fsdev=$1,mount_tag=$1"
}
export PATH="$tree/usr/bin:$PATH" LD_LIBRARY_PATH="$tree/usr/lib/x86_64-linux-gnu"
# KVM is not asked for: where it is nested it may hang. q35 starts reliably, microvm does not. The
# kernel's check of its timer fails when the emulator does not get its share of a busy machine.
start() {
    timeout "$2" qemu-system-x86_64 -nodefaults -no-user-config -no-reboot -display none \
        -L "$tree/usr/share/qemu" -L "$tree/usr/share/seabios" -M q35 -accel tcg -cpu max -smp 2 -m 1024 \
        -kernel "$dir/vmlinux" -initrd "$dir/initrd.img" -serial "file:$job/console" \
        $(share root / ,readonly=on) $(share tree "$tree" ,readonly=on) $(share job "$job" '') \
        -append "console=ttyS0 panic=-1 quiet mitigations=off no_timer_check" 2>"$job/qemu" || true
}
for try in 1 2 3; do # until it has come as far as running something
    [ -e "$job/output" ] || start "$@"
done
[ -e "$job/output" ] && cat "$job/output"
[ -s "$job/status" ] && exit "$(cat "$job/status")"
echo "boot.sh: the guest ended without a status"
tail -n 5 "$job/qemu" "$job/console" 2>/dev/null || true
exit 125
