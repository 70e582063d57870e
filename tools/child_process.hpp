#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace seastitch {

// A program started beside us, its output in a file. Ended with SIGKILL where it is still running
// when this object goes, with SIGTERM where our own process goes without that.
class ChildProcess {
 public:
  // Throws std::runtime_error where the program cannot be started.
  ChildProcess(const std::string& name,
               const std::vector<std::string>& command,
               const std::filesystem::path& output);
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  const std::string& name() const { return name_; }
  const std::filesystem::path& output() const { return output_; }
  // The exit code (128 + signal where a signal ended it), or nothing while it runs.
  std::optional<int> ExitCode();
  // SIGTERM, then waits. Nothing where it did not end in time.
  std::optional<int> Stop(std::chrono::seconds patience);

 private:
  std::string name_;
  std::filesystem::path output_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace seastitch
