#!/usr/bin/env bash
# in_guest.sh SECONDS COMMAND [ARGS]: runs a program for at most so long under a Linux kernel that has CAN,
# whatever the machine's own kernel has. Debian's user-mode-linux is that kernel as a process: it needs no
# privileges and sees the machine's files read-only. Exit status: the command's; 77 where there is no
# such kernel, with one line that says so.
set -euo pipefail
limit_s=$1
shift
kernel=$(command -v linux.uml || true)
if [ -z "$kernel" ] || ! ls /usr/lib/uml/modules/*/kernel/net/can/can.ko >/dev/null 2>&1; then
  echo "skipped: no kernel with CAN to boot here (Debian package user-mode-linux)"
  exit 77
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
printf '%q ' "$@" >"$work/command"
: >"$work/output"
# The guest's memory is a file in TMPDIR: /dev/shm of a container may be too small for it.
TMPDIR=$work timeout --kill-after=5 "$limit_s" "$kernel" mem=384M rootfstype=hostfs rootflags=/ ro quiet \
  init="$(realpath "$(dirname "$0")")/guest_init.sh" seastitch_work="$work" \
  uml_dir="$work/" con=null con0=fd:0,fd:1 </dev/null >"$work/console" 2>&1 || true
cat "$work/output"
if [ ! -s "$work/status" ]; then
  echo "the guest ended without a status (limit $limit_s s); the end of its console:" >&2
  tail -n 20 "$work/console" >&2
  exit 1
fi
exit "$(cat "$work/status")"
