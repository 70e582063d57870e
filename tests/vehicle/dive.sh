#!/bin/bash
# Runs as a service of the guest, at each boot: first everything up to the power cut, then what comes after it.
# /host/package.deb, /host/monitor and /host/can_gateway.py come from the machine; /host/phase says where we are.
set -euo pipefail
processes=(imu-driver dvl-driver mbes-driver mapper optimizer logger)
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

play_survey() {
  python3 /host/can_gateway.py can0 20001 20002 &
  seastitch bench --survey /etc/seastitch/bench/short.yaml --speed 1 >/dev/null 2>&1 &
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

before_the_power_cut() {
  dpkg -i /host/package.deb >/tmp/dpkg.log 2>&1 || { cat /tmp/dpkg.log; fail "installation"; }
  # shellcheck disable=SC2046
  [ "$(systemctl is-active $(services) seastitch.target | sort -u)" = inactive ] || fail "the installation starts services"
  say "installed"
  bring_up_can
  sed -i 's,^source: udp:224[^ ]*,source: udp:127.0.0.1:6020,' /etc/seastitch/mbes_driver.yaml
  systemctl enable --now seastitch.target 2>/dev/null
  wait_for_services
  say "seastitch.target: all services active"
  check_configuration_error
  say "a configuration error: exit status 78, not restarted"
  play_survey
  /host/monitor 120 "${processes[@]}" >/tmp/health || { cat /tmp/health; fail "HEALTH"; }
  sed 's/^/            /' /tmp/health
  say "HEALTH ok of every process"
  check_confinement
  sleep 10
  say "power cut"
  echo ready >/host/power_cut
  sleep infinity
}

after_the_power_cut() {
  bring_up_can
  wait_for_services
  play_survey
  /host/monitor 120 "${processes[@]}" >/tmp/health || { cat /tmp/health; fail "HEALTH after the power cut"; }
  say "booted again: all services active and ok by themselves"
  local first
  first=$(find /var/lib/seastitch/dives -path '*/log/*.lcmlog' | sort | head -n 1)
  seastitch info "$first" >/tmp/info || fail "the recording before the power cut cannot be read"
  grep -q MBES_PING /tmp/info || fail "no ping in the recording before the power cut"
  say "the recording before the power cut is readable"
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
