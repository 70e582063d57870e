#!/usr/bin/env bash
# check.sh DIRECTORY: the two packages that lie there. lintian finds no error; in a root that holds nothing but what
# seastitch depends on, it is installed, works, is removed and purged; with seastitch-dev another program is built.
# That shows that the dependencies of both suffice and what the maintainer scripts do without a running systemd. It does
# not show the services running under their confinement.
set -euo pipefail
# What is mounted for the clean root is gone with this script.
own_mounts=${SEASTITCH_OWN_MOUNTS:-}
if [ -z "$own_mounts" ] && [ "$(id -u)" = 0 ] && unshare --mount true 2>/dev/null; then
  SEASTITCH_OWN_MOUNTS=yes exec unshare --mount "$0" "$@"
fi
here=$(dirname "$(realpath "$0")")
package=$(realpath "$(echo "$1"/seastitch_*.deb)")
development=$(realpath "$(echo "$1"/seastitch-dev_*.deb)")
work=$(mktemp -d)
trap 'umount -q "$work"/root/{proc,dev} "$work"/development/dev 2>/dev/null; rm -rf --one-file-system "$work"' EXIT
root=$work/root

say() { printf '   %s\n' "$*"; }
fail() {
  printf 'package: %s\n' "$*" >&2
  exit 1
}
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin HOME=/tmp LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
run_dpkg() { inside dpkg "$@" >"$work/dpkg.log" 2>&1 || { cat "$work/dpkg.log" >&2; fail "dpkg $*"; }; }
# Everything in the root but what dpkg and the user database write about it, and what is made at each start.
files() {
  (cd "$root" && find . \( -path ./proc -o -path ./run -o -path ./tmp -o -path ./var/cache -o -path ./var/lib/dpkg \
    -o -path ./var/log/dpkg.log -o -path './etc/*passwd*' -o -path './etc/*group*' -o -path './etc/*shadow*' -o -path ./etc/.pwd.lock \) -prune -o -print | sort)
}
left_over() { comm -13 "$work/before" <(files); }

check_installed() {
  local program page subcommand
  for program in "$root"/usr/bin/seastitch*; do
    program=$(basename "$program")
    inside "$program" --help >/dev/null || fail "$program does not start"
    compgen -G "$root/usr/share/man/man[18]/$program.[18].gz" >/dev/null || fail "$program has no manual page"
  done
  for subcommand in $(inside seastitch --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p'); do
    [ -e "$root/usr/share/man/man1/seastitch-$subcommand.1.gz" ] || fail "seastitch $subcommand has no manual page"
  done
  for program in imu-driver dvl-driver mbes-driver nav-driver nav-output mapper optimizer logger page; do
    inside "seastitch-$program" --check-config --config "/etc/seastitch/${program/-/_}.yaml" >/dev/null ||
      fail "seastitch-$program does not take the configuration that it is shipped with"
  done
  [ "$(inside stat -c %U:%G:%a /var/lib/seastitch)" = seastitch:seastitch:750 ] ||
    fail "the directory for dives is not seastitch's"
  [ "$(inside systemctl is-enabled seastitch.target || true)" = disabled ] || fail "the installation enables itself"
  inside bash -c 'cd /usr/lib/systemd/system && systemd-analyze verify --man=no seastitch-*.service seastitch.target \
    lcm-loopback.service' >"$work/verify" 2>&1 || { cat "$work/verify" >&2; fail "units"; }
}

check_completion() {
  inside bash -c '. /usr/share/bash-completion/completions/seastitch
    complete_at() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _seastitch "$1" "${!#}"; echo "${COMPREPLY[*]}"; }
    [ "$(complete_at seastitch rep)" = replay ] && [ "$(complete_at seastitch replay --ou)" = --out ] &&
      [ "$(complete_at seastitch dive "")" = new ] &&
      [ "$(complete_at seastitch-mapper --check)" = --check-config ]' || fail "completion"
}

check_work() {
  inside seastitch bench --survey /etc/seastitch/bench/short.yaml --log /tmp/short.lcmlog >"$work/survey" 2>&1 &&
    inside seastitch replay /tmp/short.lcmlog --out /tmp/map --quiet >"$work/survey" 2>&1 ||
    { cat "$work/survey" >&2; fail "a simulated survey"; }
  [ -s "$root/tmp/map/elevation.tif" ] && [ -s "$root/tmp/map/report.html" ] || fail "a replay leaves no map"
}

# The next version, which ships two configuration files with another content.
make_next_package() {
  dpkg-deb -R "$package" "$work/next"
  sed -i 's/^Version: .*/&+next/' "$work/next/DEBIAN/control"
  echo "# of the next" | tee -a "$work"/next/etc/seastitch/{vehicle,optimizer}.yaml >/dev/null
  dpkg-deb -b "$work/next" "$root/tmp/next.deb" >/dev/null
}

check_life() {
  "$here/clean_root.sh" "$root" "$package"
  say "clean root: $(inside dpkg-query -W | wc -l) packages, $(du -sm "$root" | cut -f1) MB"
  cp "$package" "$root/tmp/seastitch.deb"
  mkdir -p "$root/etc/systemd/system/multi-user.target.wants"  # as on every Debian that has booted
  mount --bind /proc "$root/proc"
  mount --bind /dev "$root/dev"
  files >"$work/before"
  run_dpkg -i /tmp/seastitch.deb
  check_installed
  check_completion
  check_work
  say "installed: programs, manual pages, units, completion, a survey from simulation to map"

  echo "# mine" >>"$root/etc/seastitch/vehicle.yaml"
  make_next_package
  run_dpkg -i --force-confdef /tmp/next.deb
  grep -q '^# mine' "$root/etc/seastitch/vehicle.yaml" || fail "an upgrade loses the edited configuration"
  grep -q '^# of the next' "$root/etc/seastitch/vehicle.yaml.dpkg-dist" || fail "an upgrade hides the new configuration"
  grep -q '^# of the next' "$root/etc/seastitch/optimizer.yaml" || fail "an upgrade keeps the old configuration"
  run_dpkg -r seastitch
  grep -q '^# mine' "$root/etc/seastitch/vehicle.yaml" || fail "a removal loses the edited configuration"
  compgen -G "$root/usr/bin/seastitch*" && fail "a removal leaves programs"
  run_dpkg -P seastitch
  [ -z "$(left_over)" ] || fail "a purge leaves $(left_over)"

  run_dpkg -i /tmp/seastitch.deb
  inside systemctl enable seastitch.target seastitch-nav-driver.service seastitch-nav-output.service seastitch-page.service 2>/dev/null
  echo recorded >"$root/var/lib/seastitch/dive.lcmlog"
  run_dpkg -P seastitch
  [ "$(left_over | tr '\n' ' ')" = "./var/lib/seastitch ./var/lib/seastitch/dive.lcmlog " ] ||
    fail "a purge leaves other things than the dives: $(left_over)"
  say "an upgrade with another configuration and a removal keep the edited one, a purge leaves the dives and nothing else"
}

# A subscriber, and a program with every header. Where there is a clean root: with nothing installed but a compiler and
# what seastitch-dev depends on.
check_development() {
  local root=$work/development with=() prefix=/usr
  if [ -n "$own_mounts" ]; then
    "$here/clean_root.sh" "$root" "$development" cmake g++ make
    mount --bind /dev "$root/dev"
    cp "$development" "$root/tmp/development.deb"
    run_dpkg -i /tmp/development.deb
    with=(inside)
  else
    dpkg-deb -x "$development" "$root"
    prefix=$root/usr
  fi
  cp -r "$here/subscriber" "$root/subscriber"
  (cd "$root/usr/include/seastitch" && find . -name '*.hpp' | sed 's,^\./,,' | sort) |
    sed 's,.*,#include "&",; $a int main() {}' >"$root/subscriber/every_header.cpp"
  local sources=${prefix%/usr}/subscriber
  "${with[@]}" cmake -S "$sources" -B "$sources/build" -DCMAKE_PREFIX_PATH="$prefix" >"$work/cmake.log" 2>&1 &&
    "${with[@]}" cmake --build "$sources/build" >>"$work/cmake.log" 2>&1 ||
    { cat "$work/cmake.log" >&2; fail "seastitch-dev"; }
  say "seastitch-dev: a subscriber, and a program with every header, are built by find_package(Seastitch)"
}

lintian --allow-root --fail-on error "$package" "$development"
check_development
if [ -n "$own_mounts" ]; then
  check_life
else
  echo "skipped: installing into a clean root needs root and mounts of its own"
fi
