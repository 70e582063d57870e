#!/bin/sh
# The first process of the guest that check.sh boots: puts the disk (ubda) over the machine's files, so that what the
# guest writes outlives a power cut and the machine is not touched, and starts systemd there.
# $seastitch_work comes from the kernel's command line: a folder of the machine, /host in the guest.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
here=$(dirname "$0")
mount -t proc proc /proc
mount -t sysfs sys /sys
modules=/usr/lib/uml/modules/$(uname -r)/kernel
for module in fs/overlayfs/overlay net/can/can net/can/can-raw drivers/net/can/dev/can-dev drivers/net/can/vcan \
  drivers/net/veth; do
  busybox insmod "$modules/$module.ko"
done
mount -t tmpfs tmpfs /run
mkdir /run/disk /run/vehicle
mount -t ext4 /dev/ubda /run/disk
mkdir -p /run/disk/upper /run/disk/work
mount -t overlay overlay -o lowerdir=/,upperdir=/run/disk/upper,workdir=/run/disk/work,xino=off /run/vehicle
cd /run/vehicle || exit 1
mkdir -p host
mount -t hostfs -o "$seastitch_work" hostfs host
if [ ! -e etc/systemd/system/dive.service ]; then
  # A vehicle of its own: nothing of what the machine starts, nothing that it mounts.
  : >etc/fstab
  : >etc/machine-id
  echo vehicle >etc/hostname
  find etc/systemd/system -name '*.wants' -prune -exec rm -rf {} +
  mkdir -p etc/systemd/system/multi-user.target.wants
  # man-db would read the machine's 20,000 manual pages after each installation.
  rm -f var/lib/man-db/auto-update
  cat >etc/systemd/system/dive.service <<UNIT
[Unit]
Description=The test inside
After=network.target
[Service]
Type=oneshot
TimeoutStartSec=infinity
ExecStart=/bin/bash $here/dive.sh
StandardOutput=append:/host/output
StandardError=inherit
UNIT
  ln -s ../dive.service etc/systemd/system/multi-user.target.wants/dive.service
  # Swap, consoles and logins are not for this vehicle.
  for unit in getty.target systemd-logind.service systemd-networkd.service systemd-resolved.service \
    systemd-timesyncd.service systemd-udevd.service; do
    ln -sf /dev/null "etc/systemd/system/$unit"
  done
fi
umount /sys
mkdir -p run/old
pivot_root . run/old
exec chroot . /lib/systemd/systemd systemd.unit=multi-user.target
