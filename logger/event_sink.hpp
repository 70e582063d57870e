#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/storage/event_log.hpp"

namespace seastitch {

// Where a LogWriter puts events: of its writing thread alone.
class EventSink {
 public:
  struct Figures {
    std::int64_t events = 0;  // in files
    std::int64_t bytes = 0;   // of these files, since the start
    std::string file;         // written to now
    std::int64_t files_deleted = 0;
    std::int64_t bytes_deleted = 0;
    bool short_of_space = false;  // a limit is passed, and there is nothing to delete
    std::int64_t config_errors = 0;
  };

  virtual ~EventSink() = default;
  // Throws std::runtime_error "FILE: reason" where there is no room: then it did not take the
  // event.
  virtual void Write(const LogEvent& event) = 0;
  // To the kernel: survives the end of the process. Throws as Write(), and may be tried again.
  virtual void Flush() = 0;
  // Function that forces everything flushed so far to the disk. It may run on any thread, while
  // writing goes on. Throws as Write().
  virtual std::function<void()> Syncer() = 0;
  // Now and then, and after an error: makes room.
  virtual void Tidy() {}
  virtual Figures figures() const = 0;
};

}  // namespace seastitch
