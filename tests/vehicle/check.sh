#!/usr/bin/env bash
# check.sh PACKAGE.deb: a vehicle computer in a guest (../hil/uml.sh) with systemd as its first process: installs the
# package, starts seastitch.target, plays a survey over CAN and UDP until every process is ok and the doctor content, forges
# LCM from another network, cuts the power, boots again on the same disk while the survey goes on, purges. Exit status 0; 77 where no such guest can run, with one line that says so.
set -euo pipefail
here=$(realpath "$(dirname "$0")")
. "$here/../hil/uml.sh"
package=$(realpath "$1")
uml_find
if [ "$(id -u)" != 0 ]; then
  echo "skipped: systemd in the guest needs the machine's files as root sees them"
  exit 77
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$package" "$work/package.deb"
cp "$here/can_gateway.py" "$here/forger.py" "$here/nmea_ins.py" "$work/"
: >"$work/output"
truncate -s 8G "$work/disk"
mkfs.ext4 -q -F "$work/disk"

boot() { boot_uml "$work" "$1" mem=768M init="$here/guest_init.sh" ubda="$work/disk" >"$work/console" 2>&1; }

boot 600 &
guest=$!
until [ -e "$work/power_cut" ] || [ -e "$work/status" ] || ! kill -0 "$guest" 2>/dev/null; do
  sleep 0.2
done
if [ -e "$work/power_cut" ]; then
  # The kernel, and with it its PID namespace: nothing is flushed.
  pkill -KILL -P "$(pgrep -P "$guest" timeout)" || true
  wait "$guest" || true
  boot 600 || true
fi
cat "$work/output"
if [ ! -s "$work/status" ]; then
  echo "the guest ended without a status; the end of its console:" >&2
  tail -n 30 "$work/console" >&2
  exit 1
fi
exit "$(cat "$work/status")"
