#!/usr/bin/env bash
# in_guest.sh SECONDS COMMAND [ARGS]: runs a program for at most so long under a Linux kernel that has CAN
# (uml.sh). Exit status: the command's; 77 where there is no such kernel, with one line that says so.
set -euo pipefail
here=$(realpath "$(dirname "$0")")
. "$here/uml.sh"
limit_s=$1
shift
uml_find

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
printf '%q ' "$@" >"$work/command"
: >"$work/output"
(boot_uml "$work" "$limit_s" mem=384M init="$here/guest_init.sh" || true) >"$work/console" 2>&1
cat "$work/output"
if [ ! -s "$work/status" ]; then
  echo "the guest ended without a status (limit $limit_s s); the end of its console:" >&2
  tail -n 20 "$work/console" >&2
  exit 1
fi
exit "$(cat "$work/status")"
