#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/vehicle/piped_child.hpp"

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

// Runs a program, found by PATH, and returns its standard output and exit status: 127 if it is
// missing. One that takes longer than the limit is killed.
ChildResult RunProgram(const std::vector<std::string>& command, double at_most_s);

// Time limit of Machine::run.
inline constexpr double kProgramS = 2.0;

// What `seastitch doctor` reads from the computer. Tests replace single parts.
struct Machine {
  std::filesystem::path proc = "/proc";
  std::filesystem::path cgroups = "/sys/fs/cgroup";
  std::filesystem::path root = "/";  // a folder on the computer's own disk
  // State of the interfaces that systemd-networkd knows, one file per interface index.
  std::filesystem::path network_links = "/run/systemd/netif/links";
  // Search path of systemd-networkd. Of several files with one name, the first is used.
  std::vector<std::filesystem::path> network_dirs = {
      "/etc/systemd/network", "/run/systemd/network", "/usr/lib/systemd/network"};
  // Output of RunProgram() with that limit; nothing unless the exit status is 0.
  std::function<std::optional<std::string>(const std::vector<std::string>& command)> run;
  std::function<ClockState()> clock;
  std::function<FilterState(const std::filesystem::path& cgroup)> filter;

  Machine();  // this computer
};

// Properties of systemd's units, by unit and name. Properties: "NAME,NAME,...". Empty without
// systemd.
using UnitProperties = std::map<std::string, std::map<std::string, std::string>>;
UnitProperties ShowUnits(const Machine& machine,
                         const std::vector<std::string>& units,
                         const std::string& properties);

}  // namespace seastitch
