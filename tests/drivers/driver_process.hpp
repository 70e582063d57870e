#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "common/runtime/bus.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "tests/drivers/loopback.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {

// A program that runs beside the test, what it prints in a file. Found through PATH unless it has a
// slash.
class Process {
 public:
  Process(const std::string& program, std::vector<std::string> args, std::string output_file)
      : output_file_(std::move(output_file)) {
    args.insert(args.begin(), program);
    std::vector<char*> argv;
    for (std::string& arg : args) argv.push_back(arg.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ != 0) return;
    const int log = open(output_file_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    dup2(log, STDERR_FILENO);
    dup2(log, STDOUT_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  ~Process() {
    if (pid_ > 0) Stop(SIGKILL);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  int Wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  void Signal(int signal) const { kill(pid_, signal); }
  int Stop(int signal = SIGTERM) {
    Signal(signal);
    return Wait();
  }
  std::string Output() const { return TextOf(output_file_); }

 private:
  std::string output_file_;
  pid_t pid_ = -1;
};

// A shipped configuration with its source replaced, beside copies of the DBC files.
inline std::string WithSource(const TemporaryDir& dir,
                              const std::string& file,
                              const std::string& source) {
  std::string content = TextOf(ConfigFile(file));
  const std::size_t at = content.find("source: ");
  content.replace(at, content.find('\n', at) - at, "source: " + source);
  for (const char* const dbc : {"sbg_ecan.dbc", "seastitch_dvl.dbc"})
    std::filesystem::copy_file(
        ConfigFile(dbc), dir.path() / dbc, std::filesystem::copy_options::overwrite_existing);
  return dir.Write(file, content);
}

// Drivers as people start them, and our end of their bus.
class DriverProcess : public testing::Test {
 protected:
  std::unique_ptr<Process> Start(const std::string& name, const std::string& config) {
    return std::make_unique<Process>(
        Program(name),
        std::vector<std::string>{"--config", config, "--lcm-url", lcm_url},
        (dir.path() / (name + ".txt")).string());
  }
  // Opens our end of the bus; false where this machine has no multicast.
  bool OpenBus() {
    try {
      bus.emplace(lcm_url);
      bool heard = false;
      bus->Subscribe<raw_bytes_t>("TEST_LOOPBACK", 0, [&](const raw_bytes_t&) { heard = true; });
      bus->Publish("TEST_LOOPBACK", raw_bytes_t{});
      return HandleUntil([&] { return heard; }, 3000);
    } catch (const std::exception&) {
      return false;
    }
  }
  template <class Done>
  bool HandleUntil(Done done, int timeout_ms) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
    while (!done()) {
      if (std::chrono::steady_clock::now() > end) return false;
      if (WaitReadable(bus->fd(), 100)) bus->HandleReady();
    }
    return true;
  }

  const TemporaryDir dir;
  const std::string lcm_url = "udpm://239.255.76.67:" + std::to_string(FreeUdpPort()) + "?ttl=0";
  std::optional<Bus> bus;
};

}  // namespace seastitch
