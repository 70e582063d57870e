#!/usr/bin/env bash
# check.sh PACKAGE TESTS PROGRAMS: the package for arm64, unpacked beside nothing but what it depends on, and run in
# emulation (qemu-user): each process takes the configuration that it is shipped with, a simulated survey becomes a map,
# the unit tests in the folder TESTS pass, and the map is compared with that of PROGRAMS, the same build for this machine.
set -euo pipefail
package=$(realpath "$1") tests=$(realpath "$2") programs=$(realpath "$3")
here=$(dirname "$(realpath "$0")")
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
root=$work/root
say() { printf '   %s\n' "$*"; }
fail() {
  printf 'arm64: %s\n' "$*" >&2
  exit 1
}
emulate() { qemu-aarch64-static -L "$root" "$@"; }

depends=$(dpkg-deb -f "$package" Depends)
names=$(tr ',' '\n' <<<"$depends" | sed 's/^ *//; s/[ |(].*//' | sort -u | grep -v '^systemd$')
# shellcheck disable=SC2086
"$here/make_sysroot.sh" "$root" $names
dpkg-deb -x "$package" "$root"
say "unpacked with what it depends on: $(du -sm "$root" | cut -f1) MB"

# This machine has no folder of the package for dives.
sed -i "s#/var/lib/seastitch/dives#$work/dives#" "$root"/etc/seastitch/*.yaml
for program in "$root"/usr/bin/seastitch-*; do
  name=$(basename "$program" | sed 's/^seastitch-//; s/-/_/')
  emulate "$program" --check-config --config "$root/etc/seastitch/$name.yaml" >"$work/log" 2>&1 ||
    { cat "$work/log" >&2; fail "seastitch-$name does not take the configuration that it is shipped with"; }
done
say "each process takes the configuration that it is shipped with"

"$programs/seastitch" bench --survey "$root/etc/seastitch/bench/short.yaml" --log "$work/short.lcmlog" >"$work/log" 2>&1
# replay MAP PROGRAM...
replay() {
  local map=$work/$1
  shift
  "$@" replay "$work/short.lcmlog" --out "$map" --quiet >"$work/log" 2>&1 || { cat "$work/log" >&2; fail "a replay"; }
}
replay here "$programs/seastitch"
replay there emulate "$root/usr/bin/seastitch"
GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2 replay unfused "$programs/seastitch"
say "a simulated survey becomes a map; beside that of this machine:"
python3 "$here/compare_maps.py" "$work/here" "$work/there" "arm64"
python3 "$here/compare_maps.py" "$work/here" "$work/unfused" "x86-64 without FMA"

# Beside each other, the longest first, and without Monte Carlo and restarts at many moments, as under the sanitizers.
run_test() {
  local test=$1 log status=passed
  log=$2/$(basename "$1").log
  emulate "$test" --gtest_brief=1 --gtest_filter='-*MonteCarlo*:Moments/*:Faults/Restart.*' >"$log" 2>&1 ||
    { cat "$log" >&2; status=failed; }
  say "$(basename "$test"): $status"
  [ "$status" = passed ]
}
export root
export -f emulate run_test say
printf '%s\n' "$tests"/navigation_test "$tests"/*_test | awk '!seen[$0]++' |
  xargs -P "$(nproc)" -I{} bash -c 'run_test "$@"' test {} "$work" || fail "tests failed"
printf '%s, version %s, commit %s\n' "$(date -u +%Y-%m-%d)" "$(dpkg-deb -f "$package" Version)" \
  "$(git -c safe.directory='*' -C "$here" rev-parse --short HEAD)" >"$here/last_passed.txt"
say "passed: $(cat "$here/last_passed.txt")"
