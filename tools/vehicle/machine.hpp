#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace seastitch {

// State of the system clock in the kernel (adjtimex).
struct ClockState {
  bool synchronised = false;
  double error_s = 0.0;  // largest error, as the kernel estimates it
};

// Number of BPF programs that filter what a control group receives.
struct FilterState {
  int programs = 0;
  std::string trouble = {};  // reason why the number is unknown; empty if it is known
};

// Standard output of a program, found by PATH; nothing if it is missing, failed, or took longer
// than the limit.
std::optional<std::string> RunProgram(const std::vector<std::string>& command, int at_most_s);

// What `seastitch doctor` reads from the computer. Tests replace single parts.
struct Machine {
  std::filesystem::path proc = "/proc";
  std::filesystem::path cgroups = "/sys/fs/cgroup";
  // Search path of systemd for *.network files, of which the first with a name is used; and for
  // drop-ins of units.
  std::vector<std::filesystem::path> network_dirs = {
      "/etc/systemd/network", "/run/systemd/network", "/usr/lib/systemd/network"};
  // RunProgram() with a limit of 2 s, so that the doctor cannot hang.
  std::function<std::optional<std::string>(const std::vector<std::string>& command)> run;
  std::function<ClockState()> clock;
  std::function<FilterState(const std::filesystem::path& cgroup)> filter;

  Machine();  // this computer
};

}  // namespace seastitch
