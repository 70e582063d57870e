#!/bin/bash
# Runs as a service of the guest, at each boot: first everything up to the power cut, then what comes after it.
# /host/package.deb, /host/can_gateway.py, /host/forger.py and /host/nmea_ins.py come from the machine; /host/power_cut
# says where we are, /host/epoch when the survey began, /host/submaps how many submaps there were before the power cut,
# /host/names which files have the package's name before it is installed.
set -euo pipefail
processes=(imu-driver dvl-driver mbes-driver nav-driver mapper optimizer logger)
export LCM_DEFAULT_URL="udpm://239.255.76.67:7667?ttl=0"

say() { printf '   %5.1f s  %s\n' "$(cut -d' ' -f1 /proc/uptime)" "$*"; }
fail() {
  printf 'vehicle: %s\n' "$*"
  systemctl --no-pager --failed || true
  journalctl --no-pager -n 40 -u 'seastitch-*' || true
  finish 1
}
finish() {
  echo "$1" >/host/status
  sync
  systemctl poweroff --force --force
  exit 0
}
trap 'fail "line $LINENO"' ERR
services() { printf 'seastitch-%s.service ' "${processes[@]}"; }
property() { systemctl show -p "$2" --value "seastitch-$1.service"; }

bring_up_can() {
  ip link add can0 type vcan
  ip link set can0 up
}

wait_for_services() {
  local process
  for process in "${processes[@]}"; do
    timeout 60 bash -c "until systemctl -q is-active seastitch-$process; do sleep 0.5; done" ||
      fail "seastitch-$process does not become active"
  done
}

# Of 30 lines, so that it lasts longer than this; at its place of now.
play_survey() {
  [ -e /host/epoch ] || date -u +%Y-%m-%dT%H:%M:%SZ >/host/epoch
  local survey=/etc/seastitch/bench/short.yaml
  sed 's/lines: 3/lines: 30/; s/^position_fixes: .*/position_fixes: {interval_s: 2.0}/' "$survey" >/tmp/survey.yaml
  python3 /host/can_gateway.py can0 20001 20002 &
  python3 /host/nmea_ins.py 6100 &
  seastitch bench --survey /tmp/survey.yaml --epoch "$(cat /host/epoch)" \
    --from $(($(date +%s) - $(date -d "$(cat /host/epoch)" +%s))) >/tmp/bench 2>&1 &
}

# Seconds since the boot, whatever is done to the clock.
uptime_s() { cut -d. -f1 /proc/uptime; }

# WHEN: for people. Every process ok, as people see it.
wait_until_ok() {
  local end=$(($(uptime_s) + 150))
  until seastitch status --once >/tmp/status; do
    [ "$(uptime_s)" -lt $end ] || { cat /tmp/status /tmp/bench; fail "not every process is ok $1"; }
  done
  sed 's/^/            /' /tmp/status
  say "every process ok $1"
}

# How many submaps the mapper stated when wait_until_ok last asked.
submaps_stated() { awk '$1 == "mapper" {for (i = 2; i < NF; i++) if ($(i + 1) ~ /^submaps/) print $i}' /tmp/status; }

# The map goes on in the graph that the power cut interrupted.
check_one_graph() {
  local before now
  before=$(cat /host/submaps)
  now=$(submaps_stated)
  [ -z "$(find /var/lib/seastitch/dives -maxdepth 2 -name 'map-*')" ] || fail "the power cut began a second map"
  if [ "$before" -lt 1 ] || [ "$now" -lt "$before" ]; then
    fail "$before submaps before the power cut, $now after it"
  fi
  say "one graph: $before submaps before the power cut, $now after it"
}

# The kernel of the guest has the machine's time, which somebody disciplines there: it is told so.
discipline_clock() {
  python3 - <<'PYTHON'
import ctypes
import struct

libc = ctypes.CDLL(None, use_errno=True)
ADJ_MAXERROR, ADJ_ESTERROR, ADJ_STATUS = 4, 8, 16
# struct timex: modes, offset, frequency, maximum error, estimated error (microseconds), status, and much that is zero.
timex = ctypes.create_string_buffer(struct.pack("=I4xqqqqi4x", ADJ_MAXERROR | ADJ_ESTERROR | ADJ_STATUS, 0, 0, 1000, 1000, 0), 208)
if libc.adjtimex(timex) < 0:
    raise OSError(ctypes.get_errno(), "adjtimex")
PYTHON
}

# All that the doctor looks at is well, and so is its exit status; the one processor of a guest may be busy.
doctor_is_content() {
  local status=0
  seastitch doctor --under-water --json >/tmp/doctor.json || status=$?
  python3 - $status <<'PYTHON'
import json
import sys

answer = json.load(open("/tmp/doctor.json"))
checks = answer["checks"]
if int(sys.argv[1]) != ["ok", "warning", "error"].index(answer["result"]):
    sys.exit("doctor: exit status " + sys.argv[1] + " with " + answer["result"])
kinds = {check["check"] for check in checks}
expected = {"can_interface", "lcm_route", "lcm_loopback", "ip_filter", "clock", "disk_free", "process", "sensor", "value"}
sys.exit(bool(expected - kinds) or any(c["level"] != "ok" and c["check"] != "cpu" for c in checks))
PYTHON
}

# WHEN: for people. A machine that is slow for a moment is named, rightly: at most ten times.
ask_doctor() {
  local times=1
  until doctor_is_content; do
    [ $times -lt 10 ] || { cat /tmp/doctor.json; fail "the doctor is not content $1"; }
    grep -A1 '"level": "[we]' /tmp/doctor.json | sed -n 's/^ *"text"/            named/p'
    times=$((times + 1))
    sleep 2
  done
  say "the doctor finds nothing $1: $(grep -c '"level": "ok"' /tmp/doctor.json) checks, look number $times"
}

# Three faults that only a computer of one's own has: each is named.
ask_doctor_about_faults() {
  local buffer
  buffer=$(sysctl -n net.core.rmem_max)
  ip link set can0 down
  sysctl -qw net.core.rmem_max=212992
  systemctl stop seastitch-optimizer.service
  seastitch doctor --under-water >/tmp/doctor || true
  sysctl -qw net.core.rmem_max="$buffer"
  systemctl start seastitch-optimizer.service
  ip link set can0 up
  local fault
  for fault in 'CAN can0: down' 'receive buffers: at most 212992 bytes' 'optimizer: not heard' 'IP filter of optimizer: not known'; do
    grep -q "^[a-z]* *$fault" /tmp/doctor || { cat /tmp/doctor; fail "the doctor does not name: $fault"; }
  done
  say "the doctor names an interface that is down, small buffers and a service that does not run"
}

# FOLDER: how many messages of channel FORGED its recordings hold.
forged_in() {
  local log
  for log in "$1"/*/log/*.lcmlog; do
    seastitch info "$log" || true
  done | awk '$1 == "FORGED" {n += $2} END {print n + 0}'
}

make_outside() {
  ip netns add outside
  ip link add veth0 type veth peer name veth1 netns outside
  ip address add 10.77.0.1/24 dev veth0
  ip link set veth0 up
  ip -n outside address add 10.77.0.2/24 dev veth1
  ip -n outside link set lo up
  ip -n outside link set veth1 up
  ip -n outside route add default via 10.77.0.1
}

forge() {
  sleep 3
  ip netns exec outside python3 /host/forger.py 10.77.0.1 300
  sleep 2
}

# PROCESS: how many datagrams the kernel dropped before it, on LCM's port (hexadecimal 1DF3).
dropped_for() {
  local sockets
  sockets=$(find "/proc/$(property "$1" MainPID)/fd" -lname 'socket:*' -printf '%l\n' | tr -dc '0-9\n' | paste -sd '|')
  awk -v sockets="^($sockets)\$" '$2 ~ /:1DF3$/ && $10 ~ sockets {n += $13} END {print n + 0}' /proc/net/udp
}

# PROCESS: the datagrams to this computer come to it, which opened its socket last. Its filter drops all of them.
forge_to() {
  local before dropped
  systemctl restart "seastitch-$1.service"
  before=$(dropped_for "$1")
  forge
  dropped=$(($(dropped_for "$1") - before))
  [ "$dropped" -ge 300 ] || fail "of 300 forged datagrams to seastitch-$1 $dropped were dropped"
  say "the filter of the $1 dropped $dropped forged datagrams"
}

# From another network, to this computer and to the group. Of several sockets on a port the kernel gives a unicast
# datagram to the one that was opened last: first the installed logger, then one that no unit confines, as the control.
forge_from_outside() {
  make_outside
  systemctl restart seastitch-logger.service
  forge
  mkdir -p /tmp/control/config /tmp/control/dives
  sed "s,^dives_dir: .*,dives_dir: /tmp/control/dives," /etc/seastitch/logger.yaml >/tmp/control/config/logger.yaml
  seastitch-logger --config /tmp/control/config/logger.yaml >/tmp/control/output 2>&1 &
  local control=$!
  forge
  kill "$control"
  wait "$control" || true
  local taken_without taken
  taken_without=$(forged_in /tmp/control/dives)
  taken=$(forged_in /var/lib/seastitch/dives)
  [ "$taken_without" -gt 0 ] || fail "nobody took a forged message: the experiment shows nothing"
  [ "$taken" = 0 ] || fail "the logger took $taken forged messages"
  say "forged from another network, 300 to this computer and 300 to the group: the logger took none, one without the unit's filter $taken_without"
  forge_to mapper
  forge_to optimizer
}

# SECONDS: the kernel's clock is set by so much. The mapper says so within 10 s; a minute later all is well again, and
# submaps go on.
step_the_clock() {
  local before after end
  before=$(submaps_stated)
  date -s "@$(($(date +%s) + $1))" >/dev/null
  end=$(($(uptime_s) + 10))
  until seastitch status --json --once >/tmp/status.json || true; grep -q '"clock_step"' /tmp/status.json; do
    [ "$(uptime_s)" -lt $end ] || { cat /tmp/status.json; fail "nobody names a clock that was set by $1 s"; }
  done
  wait_until_ok "after the clock was set by $1 s"
  after=$(submaps_stated)
  [ "$after" -gt "$before" ] || fail "$before submaps before the clock was set, $after after it"
}

# A wrong key ends the process once, with 78 and one line.
check_configuration_error() {
  local file=/etc/seastitch/optimizer.yaml
  cp "$file" /tmp/optimizer.yaml
  echo "no_such_key: 1" >>"$file"
  systemctl restart seastitch-optimizer.service 2>/dev/null || true
  sleep 5
  [ "$(property optimizer ActiveState) $(property optimizer ExecMainStatus) $(property optimizer NRestarts)" = "failed 78 0" ] ||
    fail "a wrong configuration: $(systemctl show -p ActiveState,ExecMainStatus,NRestarts seastitch-optimizer.service)"
  journalctl --no-pager -u seastitch-optimizer.service | grep 'optimizer.yaml: no_such_key: unknown key' >/dev/null ||
    fail "a wrong configuration is not named in the journal"
  cp /tmp/optimizer.yaml "$file"
  systemctl reset-failed seastitch-optimizer.service
  systemctl start seastitch-optimizer.service
}

# What systemd makes of the units and of the drop-in that all of them have.
check_settings() {
  local process memory devices
  for process in "${processes[@]}"; do
    case $process in
      mapper) memory=2147483648 ;;
      optimizer | logger) memory=1073741824 ;;
      *) memory=536870912 ;;
    esac
    devices=yes
    [ "$process" != nav-driver ] || devices=no
    [ "$(property "$process" MemoryMax) $(property "$process" PrivateDevices)" = "$memory $devices" ] ||
      fail "seastitch-$process: $(systemctl show -p MemoryMax,PrivateDevices "seastitch-$process.service" | xargs)"
  done
  say "each unit has its own memory limit, and all but the nav-driver's a private /dev"
}

# What of it this guest's kernel can do: User-Mode Linux may lack seccomp and BPF.
check_confinement() {
  local process status
  for process in "${processes[@]}"; do
    status=/proc/$(property "$process" MainPID)/status
    [ "$(awk '/^(CapEff|NoNewPrivs):/ {print $2}' "$status" | xargs)" = "0000000000000000 1" ] ||
      fail "seastitch-$process has privileges: $(grep -E '^(Cap|NoNew)' "$status" | xargs)"
    [ "$(property "$process" NRestarts)" = 0 ] || fail "seastitch-$process was restarted"
  done
  say "confined: no capability, no new privileges; system calls filtered: $(grep -q '^Seccomp:.*2' "$status" && echo yes ||
    echo 'not in this kernel'); IP packets: $(journalctl -b | grep 'not support BPF/cgroup firewalling' >/dev/null &&
    echo 'not in this kernel' || echo yes)"
}

# Files with the package's name that dpkg does not list, but for the dives.
named() { find /etc /var -path /var/lib/seastitch -prune -o -name '*seastitch*' -print | sort; }

# A data disk whose mount ends, as systemd ends it when the device is gone: the logger stops, navigation and map go on.
check_data_disk() {
  local process expected
  printf '[Mount]\nWhat=tmpfs\nWhere=/data\nType=tmpfs\n' >/etc/systemd/system/data.mount
  systemctl daemon-reload
  systemctl start data.mount
  install -d -o seastitch -g seastitch -m 0750 /data/seastitch
  for process in logger mapper; do
    install -D -m 0644 "/usr/share/doc/seastitch/examples/data-disk-$process.conf" \
      "/etc/systemd/system/seastitch-$process.service.d/data-disk.conf"
    sed -i 's,^dives_dir: .*,dives_dir: /data/seastitch/dives,' "/etc/seastitch/$process.yaml"
  done
  systemctl daemon-reload
  systemctl restart seastitch-logger.service seastitch-mapper.service
  wait_for_services
  seastitch doctor --under-water >/tmp/doctor || true
  [ "$(grep -c '^ok *drop-in of' /tmp/doctor)" = 2 ] || { cat /tmp/doctor; fail "the drop-ins for a data disk"; }
  systemctl stop data.mount
  for process in "${processes[@]}"; do
    expected=active
    [ "$process" != logger ] || expected=inactive
    [ "$(systemctl is-active "seastitch-$process.service")" = $expected ] ||
      fail "seastitch-$process is not $expected without the data disk"
  done
  seastitch doctor --under-water >/tmp/doctor || true
  grep -q '^warning *data disk of /data/seastitch/dives: not mounted' /tmp/doctor ||
    { cat /tmp/doctor; fail "the doctor does not name a missing data disk"; }
  rm -r /etc/systemd/system/data.mount /etc/systemd/system/seastitch-{logger,mapper}.service.d
  systemctl daemon-reload
  say "without its data disk the logger stops, every other process runs on, and the doctor names it"
}

before_the_power_cut() {
  named >/host/names
  dpkg -i /host/package.deb >/tmp/dpkg.log 2>&1 || { cat /tmp/dpkg.log; fail "installation"; }
  # shellcheck disable=SC2046
  [ "$(systemctl is-active $(services) seastitch.target | sort -u)" = inactive ] || fail "the installation starts services"
  say "installed"
  bring_up_can
  sed -i 's,^source: .*,source: "udp:127.0.0.1:6020?from=127.0.0.1",' /etc/seastitch/mbes_driver.yaml
  sed -i '/^ins:/a\  source: "udp:127.0.0.1:6100"' /etc/seastitch/nav_driver.yaml
  systemctl enable seastitch-nav-driver.service 2>/dev/null
  systemctl enable --now seastitch.target 2>/dev/null
  wait_for_services
  say "seastitch.target: all services active"
  check_settings
  check_configuration_error
  say "a configuration error: exit status 78, not restarted"
  discipline_clock
  play_survey
  wait_until_ok "in the survey"
  check_confinement
  ask_doctor "in the survey"
  forge_from_outside
  ask_doctor_about_faults
  wait_until_ok "after these faults"
  step_the_clock 90
  step_the_clock -90
  submaps_stated >/host/submaps
  sleep 10
  say "power cut"
  echo ready >/host/power_cut
  sleep infinity
}

after_the_power_cut() {
  bring_up_can
  discipline_clock
  wait_for_services
  play_survey
  wait_until_ok "after the power cut"
  check_one_graph
  ask_doctor "after the power cut"
  local first
  first=$(find /var/lib/seastitch/dives -path '*/log/*.lcmlog' | sort | head -n 1)
  seastitch info "$first" >/tmp/info || fail "the recording before the power cut cannot be read"
  grep -q MBES_PING /tmp/info || fail "no ping in the recording before the power cut"
  [ "$(find /var/lib/seastitch/dives -maxdepth 1 -name 'DIVE_*' | wc -l)" = 1 ] || fail "the power cut made a second dive"
  [ "$(find /var/lib/seastitch/dives -path '*/log/*.lcmlog' | wc -l)" = 3 ] || fail "not one recording a start in the dive"
  say "the recording before the power cut is readable; the same dive goes on"
  check_data_disk
  systemctl stop seastitch.target 'seastitch-*.service'
  # shellcheck disable=SC2046
  ! systemctl -q is-active $(services) || fail "services outlive the target"
  find /var/lib/seastitch -type f | sort >/tmp/dives
  dpkg -L seastitch | sed 1d >/tmp/listed
  dpkg -P seastitch >/tmp/dpkg.log 2>&1 || { cat /tmp/dpkg.log; fail "purge"; }
  local file
  while read -r file; do
    [ -d "$file" ] || [ ! -e "$file" ] || fail "a purge leaves $file"
  done </tmp/listed
  named | cmp -s - /host/names || fail "a purge leaves $(named | comm -13 /host/names - | xargs)"
  [ ! -e /etc/seastitch ] || fail "a purge leaves /etc/seastitch"
  find /var/lib/seastitch -type f | sort | cmp -s - /tmp/dives || fail "a purge takes dives along"
  say "purged: $(wc -l </tmp/dives) files of the dives are left"
  finish 0
}

if [ -e /host/power_cut ]; then
  after_the_power_cut
else
  before_the_power_cut
fi
