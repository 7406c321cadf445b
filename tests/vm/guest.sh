#!/bin/sh
# guest.sh cameras|webcam|lights BIN - in the guest: loads kernel drivers that act devices, runs the tests
# on them, and prints one line a driver, "RESULT driver device passed failed", and figures.
bin=$2
bad=0

result() { # driver, device, test program; its output is shown when anything fails
    driver=$1 device=$2
    shift 2
    timeout 150 "$@" >/tmp/out 2>&1
    status=$?
    failed=$(grep -c '^\[  FAILED  \] [a-z]' /tmp/out)
    passed=$(grep -c '^\[       OK \]' /tmp/out)
    [ $status -ne 0 ] && [ "$failed" -eq 0 ] && failed=1
    [ "$failed" -gt 0 ] && bad=1 && grep -v '^\[ RUN' /tmp/out
    sed -n -e '/after .* ms:/s/^/FIGURE /p' -e '/^a camera with/s/^/FIGURE /p' /tmp/out
    echo "RESULT $driver $device $passed $((failed > 1 ? failed / 2 : failed))"
}
camera() { result "${1%%:*}" "$1" env TEST_CAM="$1" "$bin/test_conformance"; }
trigger() { result "${1%%:*}" "$1" env TEST_TRIG="$1" "$bin/test_conformance"; }
until_there() { # path; 10 s
    n=0
    while [ ! -e "$1" ] && [ $n -lt 100 ]; do n=$((n + 1)); sleep 0.1; done
}

start() {
    echo "UPTIME $(cut -d' ' -f1 /proc/uptime)"
    modprobe configfs
    mount -t configfs none /sys/kernel/config
    addgroup --system nacre >/dev/null 2>&1 || echo nacre:x:990: >>/etc/group
    mkdir -p /etc/udev/rules.d
    cp "$(dirname "$0")/../../acquire/udev/70-nacre.rules" /etc/udev/rules.d/
    /usr/lib/systemd/systemd-udevd --daemon
}

# Three of vivid: a webcam, one of several planes, an HDMI grabber.
cameras() {
    modprobe vivid n_devs=3 multiplanar=1,2,1 node_types=0x1,0x1,0x1 num_inputs=1,1,1 input_types=0x0,0x0,0x3
    until_there /dev/video2
    udevadm settle
    [ "$(stat -c %G /dev/video0)" = nacre ] || { echo "udev rules: /dev/video0 is not of the group nacre"; bad=1; }
    "$bin/nacre" doctor --devices | grep 'found v4l2'
    camera v4l2:/dev/video0
    camera v4l2:/dev/video0,format=BG12,w=640,h=360,unity=16
    camera v4l2:/dev/video1,memory=dmabuf
    camera v4l2:/dev/video0,format=YUYV
    v4l2-compliance -s -d /dev/video0 2>/dev/null | sed -n 's/^Total for/FIGURE v4l2-compliance of/p'
    result v4l2 faults-of-vivid env TEST_VIVID=/dev/video0 TEST_VIVID_HDMI=/dev/video2 "$bin/test_v4l2"
    modprobe -r vivid
    modprobe vimc
    udevadm settle
    "$bin/nacre" doctor --devices | grep 'found libcamera'
    camera libcamera:0,w=318,h=240
    camera libcamera:0,w=636,h=480
}

# A USB camera in user space, under the kernel's own driver of such cameras.
webcam() {
    modprobe -a dummy_hcd raw_gadget uvcvideo
    "$bin/vm_uvc_camera" dummy_udc.0 &
    until_there /dev/video0
    udevadm settle
    "$bin/nacre" doctor --devices | grep 'found v4l2'
    camera v4l2:/dev/video0,bits=12,black=64,unity=16
    camera v4l2:/dev/video0,fps=10,memory=dmabuf
    v4l2-compliance -s -d /dev/video0 2>/dev/null | sed -n 's/^Total for/FIGURE v4l2-compliance of/p'
    kill $!
    wait $!
    result v4l2 exposure-and-unplugging env TEST_UVC="$bin/vm_uvc_camera dummy_udc.0" "$bin/test_uvc"
}

usb_device() { # relay|wheel, vendor, product, name, controller
    g=/sys/kernel/config/usb_gadget/$1
    mkdir -p "$g/strings/0x409" "$g/configs/c.1" "$g/functions/ffs.$1" "/dev/ffs-$1"
    echo "$2" >"$g/idVendor"
    echo "$3" >"$g/idProduct"
    echo "$4" >"$g/strings/0x409/product"
    echo "N1" >"$g/strings/0x409/serialnumber"
    ln -s "$g/functions/ffs.$1" "$g/configs/c.1"
    mount -t functionfs "$1" "/dev/ffs-$1"
    "$bin/vm_hid_device" "$1" "/dev/ffs-$1" || return
    echo "$5" >"$g/UDC"
}

lights() {
    modprobe gpio-sim
    sim=/sys/kernel/config/gpio-sim/lab
    mkdir -p $sim/bank0/line1 $sim/bank0/line2
    echo 8 >$sim/bank0/num_lines
    echo led >$sim/bank0/line1/name
    echo flash >$sim/bank0/line2/name
    echo 1 >$sim/live
    until_there /dev/gpiochip0
    modprobe -a libcomposite usb_f_fs usbhid hid-generic
    modprobe dummy_hcd num=2
    usb_device relay 0x16c0 0x05df USBRelay4 dummy_udc.0
    usb_device wheel 0x1278 0x0920 "SX Filter Wheel" dummy_udc.1
    until_there /sys/bus/usb/devices/2-1/idVendor
    udevadm settle
    "$bin/nacre" doctor --devices | grep 'found [gu]'
    trigger gpiod:gpiochip0,lines=1+flash+4
    trigger gpiod:gpiochip0,lines=led,active-low=1
    result gpiod values-on-the-pins env TEST_GPIO=/sys/devices/platform/gpio-sim.0/gpiochip0 "$bin/test_gpiod"
    trigger usb:relay
    trigger usb:relay,serial=NACRE,lines=3
    trigger usb:wheel
    trigger usb:wheel,positions=4,timeout=5s
    result usb unplug env TEST_UDC=/sys/kernel/config/usb_gadget "$bin/test_usb"
}

start
"$1"
exit $bad
