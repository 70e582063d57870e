#include "tools/vehicle/piped_child.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <system_error>

#include "common/runtime/health.hpp"

namespace seastitch {

int WriteText(int out, const std::string& text) {
  return write(out, text.data(), text.size()) == std::ssize(text) ? EXIT_SUCCESS : EXIT_FAILURE;
}

PipedChild::PipedChild(const std::function<int(int out)>& body) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  out_ = FileDescriptor(ends[0]);
  const FileDescriptor in(ends[1]);
  pid_ = fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Who reads what this process prints, need not wait for a child that hangs.
  const int nothing = open("/dev/null", O_RDWR);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, stream);
  try {
    _exit(body(in.get()));
  } catch (...) {
    _exit(EXIT_FAILURE);
  }
}

PipedChild::~PipedChild() {
  if (result_.exit_status) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, WNOHANG);
}

ChildResult PipedChild::WaitUntil(double end_s) {
  while (!result_.exit_status) {
    const double left_s = std::max(0.0, end_s - MonotonicSeconds());
    pollfd waiting{out_.get(), POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(1e3 * left_s));
    if (ready == 0) break;
    if (ready < 0) continue;  // a signal
    char bytes[4096];
    const ssize_t got = read(out_.get(), bytes, sizeof bytes);
    if (got > 0) result_.output.append(bytes, static_cast<std::size_t>(got));
    int status = 0;
    if (got == 0 && waitpid(pid_, &status, 0) == pid_)
      result_.exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return result_;
}

}  // namespace seastitch
