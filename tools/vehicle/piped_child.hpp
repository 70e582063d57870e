#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

#include "drivers/socket/file_descriptor.hpp"

namespace seastitch {

struct ChildResult {
  std::string output;              // what it has written until then
  std::optional<int> exit_status;  // 128 + signal if a signal ended it; nothing if it still runs
};

// Body of a child that returns a text.
int WriteText(int out, const std::string& text);

// A function in a process of its own, which returns text through a pipe. For calls that may never
// return: the kernel does not interrupt access to a disk that hangs, but this process need not
// wait.
class PipedChild {
 public:
  // body: runs in the child, with /dev/null for the standard streams; writes to the descriptor and
  // returns the exit status. Throws std::system_error if there can be no process.
  explicit PipedChild(const std::function<int(int out)>& body);
  // Sends SIGKILL to a child that still runs, and does not wait for it.
  ~PipedChild();
  PipedChild(const PipedChild&) = delete;
  PipedChild& operator=(const PipedChild&) = delete;

  // Waits for its end, at most until this time [s, monotonic].
  ChildResult WaitUntil(double end_s);

 private:
  FileDescriptor out_;
  pid_t pid_ = -1;
  ChildResult result_;
};

}  // namespace seastitch
