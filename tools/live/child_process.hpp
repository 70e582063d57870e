#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace seastitch {

// A child process with its output in a file. If it still runs when this object is destroyed, it
// gets SIGKILL; if this process ends otherwise, it gets SIGTERM.
class ChildProcess {
 public:
  // Throws std::runtime_error if the program cannot be started.
  ChildProcess(const std::string& name,
               const std::vector<std::string>& command,
               const std::filesystem::path& output);
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  const std::string& name() const { return name_; }
  const std::filesystem::path& output() const { return output_; }
  // The exit code (128 + signal if a signal ended it); nothing while it runs.
  std::optional<int> ExitCode();
  // Sends SIGTERM and waits. Nothing if the process did not end in time.
  std::optional<int> Stop(std::chrono::seconds patience);

 private:
  std::string name_;
  std::filesystem::path output_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace seastitch
