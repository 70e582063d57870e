# shellcheck shell=bash
# Sourced: boots Debian's user-mode-linux, a Linux kernel as a process, which has CAN whatever the machine's kernel
# has. It needs no privileges and sees the machine's files read-only.
#
#   uml_find                          77 where there is none, with one line that says so
#   boot_uml WORK SECONDS ARGS...     at most so long; WORK: a folder for its memory, its output is on stdout
uml_find() {
  uml_kernel=$(command -v linux.uml || true)
  if [ -z "$uml_kernel" ] || ! ls /usr/lib/uml/modules/*/kernel/net/can/can.ko >/dev/null 2>&1; then
    echo "skipped: no kernel with CAN to boot here (Debian package user-mode-linux)"
    exit 77
  fi
  # Lets it run on processors with AMX too; built with the tests.
  uml_preload=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../../build/tests/seastitch_whole_xstate.so")
  # The guest's processes are processes of this machine: in a PID namespace of their own they end with their kernel,
  # however that ends. Where that is not allowed, it runs without.
  uml_alone=(unshare --pid --fork --kill-child=KILL)
  [ "$(id -u)" = 0 ] || uml_alone+=(--map-root-user)
  "${uml_alone[@]}" true 2>/dev/null || uml_alone=()
}

# The guest's memory is a file in TMPDIR: /dev/shm of a container may be too small for it. Every file that the guest
# has in use is open in its kernel.
boot_uml() {
  local work=$1 limit_s=$2
  shift 2
  ulimit -n "$(ulimit -Hn)"
  TMPDIR=$work timeout --kill-after=5 "$limit_s" "${uml_alone[@]}" env LD_PRELOAD="$uml_preload" \
    "$uml_kernel" rootfstype=hostfs rootflags=/ ro quiet uml_dir="$work/" seastitch_work="$work" \
    con=null con0=fd:0,fd:1 "$@" </dev/null
}
