#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/storage/event_log.hpp"

namespace seastitch {

// Destination of a LogWriter's events. Used by its writing thread only.
class EventSink {
 public:
  struct Figures {
    std::int64_t events = 0;  // written since the start
    std::int64_t bytes = 0;   // written since the start
    std::string file;         // current file
    std::int64_t files_deleted = 0;
    std::int64_t bytes_deleted = 0;
    bool short_of_space = false;  // a limit is exceeded, and no file may be deleted
    std::int64_t config_errors = 0;
    std::int64_t files_vanished = 0;  // deleted by others, or hidden, while they were written
  };

  virtual ~EventSink() = default;
  // Throws std::runtime_error "FILE: reason" where the event could not be written, such as on a
  // full disk. It has to be written again.
  virtual void Write(const LogEvent& event) = 0;
  // Writes buffers to the kernel: survives a crash of the process. Throws as Write(), and may be
  // called again.
  virtual void Flush() = 0;
  // Function that calls fsync for everything flushed so far: survives a power cut. It may run on
  // any thread, during writing. Throws as Write().
  virtual std::function<void()> Syncer() = 0;
  // Deletes old files where a limit is exceeded. Called every few seconds, and after an error.
  virtual void Tidy() {}
  virtual Figures figures() const = 0;
};

}  // namespace seastitch
