#include "tools/vehicle/machine.hpp"

#include <fcntl.h>
#include <linux/bpf.h>
#include <sys/syscall.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>

#include "common/runtime/health.hpp"
#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {
namespace {

ClockState ReadClock() {
  timex state{};
  const int code = adjtimex(&state);
  return {.synchronised = code >= 0 && code != TIME_ERROR && (state.status & STA_UNSYNC) == 0,
          .error_s = 1e-6 * static_cast<double>(state.maxerror)};
}

FilterState ReadFilter(const std::filesystem::path& cgroup) {
  const FileDescriptor folder(open(cgroup.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder) return {.trouble = cgroup.string() + ": " + std::strerror(errno)};
  bpf_attr query;
  std::memset(&query, 0, sizeof query);
  query.query.target_fd = static_cast<std::uint32_t>(folder.get());
  query.query.attach_type = BPF_CGROUP_INET_INGRESS;
  if (syscall(SYS_bpf, BPF_PROG_QUERY, &query, sizeof query) != 0)
    return {.trouble = std::string("BPF_PROG_QUERY: ") + std::strerror(errno)};
  return {.programs = static_cast<int>(query.query.prog_cnt)};
}

}  // namespace

ChildResult RunProgram(const std::vector<std::string>& command, double at_most_s) {
  std::vector<std::string> words = command;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  PipedChild child([&](int out) {
    dup2(out, STDOUT_FILENO);
    execvp(argv[0], argv.data());
    return 127;
  });
  return child.WaitUntil(MonotonicSeconds() + at_most_s);
}

Machine::Machine()
    : run([](const std::vector<std::string>& command) -> std::optional<std::string> {
        const ChildResult result = RunProgram(command, kProgramS);
        return result.exit_status == 0 ? std::optional(result.output) : std::nullopt;
      }),
      clock(ReadClock),
      filter(ReadFilter) {}

UnitProperties ShowUnits(const Machine& machine,
                         const std::vector<std::string>& units,
                         const std::string& properties) {
  std::vector<std::string> command{"systemctl", "show", "-p", "Id," + properties, "--"};
  command.insert(command.end(), units.begin(), units.end());
  std::istringstream lines(machine.run(command).value_or(""));
  UnitProperties shown;
  std::map<std::string, std::string> unit;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) unit.clear();  // between two units
    if (const std::size_t equals = line.find('='); equals != std::string::npos)
      unit[line.substr(0, equals)] = line.substr(equals + 1);
    if (unit.contains("Id")) shown[unit["Id"]] = unit;
  }
  return shown;
}

}  // namespace seastitch
