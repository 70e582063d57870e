#!/bin/sh
# The first process of the guest that in_guest.sh boots. $seastitch_work comes from the kernel's command
# line: the folder on the machine for the command, its output and its status.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/run TMPDIR=/run
here=$(dirname "$0")
mount -t proc proc /proc
mount -t sysfs sys /sys
mkdir /dev/pts && mount -t devpts devpts /dev/pts
mount -t tmpfs tmpfs /run
mkdir /run/work && mount -t hostfs -o "$seastitch_work" hostfs /run/work

modules=/usr/lib/uml/modules/$(uname -r)/kernel
for module in net/can/can net/can/can-raw drivers/net/can/dev/can-dev drivers/net/can/vcan drivers/net/can/slcan/slcan \
  drivers/net/dummy; do
  busybox insmod "$modules/$module.ko"
done
ip link set lo up
ip link set lo multicast on
ip route add 224.0.0.0/4 dev lo
busybox sysctl -q -p "$here/../../deploy/sysctl.d/60-seastitch.conf"

sh /run/work/command >/run/work/output 2>&1 </dev/null
echo $? >/run/work/status
busybox poweroff -f
