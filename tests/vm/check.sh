#!/bin/sh
# check.sh BUILD - make check-vm: the drivers of real devices on the kernel's own code paths, in an
# emulated machine whose devices are drivers, too. Skips, and says so, where it cannot be made.
set -eu
build=$(cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
vm=${NACRE_VM:-$build/vm}
begin=$(date +%s)
"$here/fetch.sh" "$vm" || { [ $? -eq 77 ] && exit 0; exit 1; }
echo "guest ready after $(($(date +%s) - begin)) s: $(basename "$vm"/tree/boot/vmlinuz-*), emulated"
bad=0
for part in lights cameras webcam; do
    from=$(date +%s)
    status=0
    "$here/boot.sh" "$vm" 600 "$here/guest.sh $part $build/bin" >"$vm/$part.log" 2>&1 || status=$?
    [ $status -eq 0 ] || bad=1
    echo "$part: $(($(date +%s) - from)) s, of them booting $(sed -n 's/^UPTIME //p' "$vm/$part.log") s"
    sed -n -e 's/^FIGURE /    /p' \
        -e 's/^RESULT \([^ ]*\) \([^ ]*\) \([0-9]*\) \([0-9]*\)/    \1 \2: \3 passed, \4 failed/p' "$vm/$part.log"
    [ $status -eq 0 ] || grep -v -e '^RESULT' -e '^UPTIME' -e '^FIGURE' "$vm/$part.log" || true
done
echo "check-vm: $([ $bad -eq 0 ] && echo passed || echo FAILED) in $(($(date +%s) - begin)) s"
exit $bad
