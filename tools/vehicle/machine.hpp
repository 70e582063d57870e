#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace seastitch {

// What the kernel knows of the system clock (adjtimex).
struct ClockState {
  bool synchronised = false;
  double error_s = 0.0;  // at most, as the kernel estimates it
};

// How many programs of the kernel filter what a control group receives.
struct FilterState {
  int programs = 0;
  std::string trouble = {};  // why the kernel gives no answer; empty: it does
};

// The standard output of a program (found by PATH) that may take so long; nothing where it is
// missing, failed or took longer.
std::optional<std::string> RunProgram(const std::vector<std::string>& command, int at_most_s);

// What `seastitch doctor` reads from the computer. Tests replace single parts.
struct Machine {
  std::filesystem::path proc = "/proc";
  std::filesystem::path cgroups = "/sys/fs/cgroup";
  // Where systemd looks for *.network, the first that has a file wins; and for drop-ins of units.
  std::vector<std::filesystem::path> network_dirs = {
      "/etc/systemd/network", "/run/systemd/network", "/usr/lib/systemd/network"};
  // RunProgram() for at most 2 s: the doctor may not hang.
  std::function<std::optional<std::string>(const std::vector<std::string>& command)> run;
  std::function<ClockState()> clock;
  std::function<FilterState(const std::filesystem::path& cgroup)> filter;

  Machine();  // this computer
};

}  // namespace seastitch
