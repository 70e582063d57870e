#include "tools/vehicle/machine.hpp"

#include <fcntl.h>
#include <linux/bpf.h>
#include <sys/syscall.h>
#include <sys/timex.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

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

std::optional<std::string> RunProgram(const std::vector<std::string>& command, int at_most_s) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
  const FileDescriptor out(ends[0]);
  FileDescriptor in(ends[1]);
  std::vector<std::string> words{"timeout", std::to_string(at_most_s)};
  words.insert(words.end(), command.begin(), command.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    const int nothing = open("/dev/null", O_RDWR);
    dup2(nothing, STDIN_FILENO);
    dup2(in.get(), STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  if (child < 0) return std::nullopt;
  in = FileDescriptor();
  std::string text;
  char bytes[4096];
  for (ssize_t got; (got = read(out.get(), bytes, sizeof bytes)) > 0;)
    text.append(bytes, static_cast<std::size_t>(got));
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return std::nullopt;
  return text;
}

Machine::Machine()
    : run([](const std::vector<std::string>& command) { return RunProgram(command, 2); }),
      clock(ReadClock),
      filter(ReadFilter) {}

}  // namespace seastitch
