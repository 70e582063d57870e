#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "logger/event_sink.hpp"

namespace seastitch {

// Puts events on the disk beside the loop, so that a slow disk delays nothing and a full one ends
// nothing: then the file stays whole, events wait in a queue of bounded size, and what the queue
// has no room for is counted. One thread writes, so that the end of the process costs no more than
// the flush interval; another brings what was written to the disk, however long that takes.
class LogWriter {
 public:
  struct Status {
    std::int64_t events_written = 0;
    std::int64_t events_dropped = 0;     // the queue was full
    std::int64_t events_unloggable = 0;  // no log can hold them: see IsLoggable()
    std::int64_t queued_bytes = 0;
    EventSink::Figures files;
    std::int64_t write_errors = 0;
    double oldest_s = 0.0;  // how long the oldest event that is not on the disk has waited
    std::string error;      // of the last attempt; empty: it went well
  };

  LogWriter(std::unique_ptr<EventSink> files,
            std::int64_t max_queue_bytes,
            std::chrono::milliseconds flush_interval);
  ~LogWriter();  // Finish()
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  void Add(LogEvent event);
  Status status() const;
  // Writes all that is queued, to the disk, and ends the thread. On a full disk it gives up after
  // one attempt; the rest counts as dropped.
  void Finish();

 private:
  void WriteMain();
  void SyncMain();
  void SyncOnce(std::unique_lock<std::mutex>* lock);
  // Writes to the kernel; takes from the batch what the file took, and adds up its cost. Gives the
  // error, empty if none.
  std::string WriteBatch(std::deque<LogEvent>* batch, std::int64_t* cost);
  // Puts what is left before what came meanwhile.
  void TakeBack(std::deque<LogEvent> left);

  std::string TidyNow(bool after_error);

  const std::unique_ptr<EventSink> files_;  // of the writing thread alone
  const std::int64_t max_queue_bytes_;
  const std::chrono::milliseconds flush_interval_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<LogEvent> queue_;
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> queued_since_;    // the oldest event of the queue ...
  std::optional<Clock::time_point> batch_since_;     // ... of what is being written ...
  std::optional<Clock::time_point> unsynced_since_;  // ... was written ...
  std::optional<Clock::time_point> syncing_since_;   // ... and is being brought to the disk
  std::function<void()> sync_;                       // does that
  std::string write_error_;
  std::string sync_error_;
  Clock::time_point tidied_{};  // last; of the writing thread alone
  std::int64_t events_taken_ = 0;
  Status status_;
  bool stop_ = false;
  bool stop_sync_ = false;
  std::thread writer_;
  std::thread syncer_;
};

}  // namespace seastitch
