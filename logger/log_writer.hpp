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

// Writes events to files in background threads, so that a slow disk does not delay the event loop
// and a full disk does not end the process. If the disk is full, the file stays intact and events
// wait in a queue of bounded size. Events that come while the queue is full are dropped and
// counted. Raw bytes (RAW_*) have a folder of their own, and at most three quarters of the queue:
// an event of theirs that cannot be written holds up none of the others, and the reverse.
//
// One thread writes to the kernel eight times per flush interval: a crash of the process loses less
// than the interval. A second thread calls fsync once per flush interval, or as often as the disk
// permits: a power cut loses what came since the begin of the last completed fsync.
class LogWriter {
 public:
  struct Status {
    std::int64_t events_written = 0;
    std::int64_t events_dropped = 0;     // came while the queue was full
    std::int64_t events_unloggable = 0;  // cannot be stored: see IsLoggable()
    std::int64_t queued_bytes = 0;       // including those being written
    EventSink::Figures files;
    std::int64_t write_errors = 0;  // failed attempts to write or to fsync
    double oldest_s = 0.0;  // age of the oldest event that was not brought to the disk by fsync
    std::string error;      // of the last attempt to write or to fsync; empty: it succeeded
  };

  LogWriter(std::unique_ptr<EventSink> files,
            std::int64_t max_queue_bytes,
            std::chrono::milliseconds flush_interval);
  ~LogWriter();  // Finish()
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  // Queues an event. Never waits for the disk. Any thread.
  void Add(LogEvent event);
  Status status() const;
  // Writes the whole queue, calls fsync, and ends both threads. On a full disk it gives up after
  // one attempt; the remaining events count as dropped.
  void Finish();

 private:
  void WriteMain();
  void SyncMain();
  void SyncOnce(std::unique_lock<std::mutex>* lock);
  // Bytes in the queue.
  struct Cost {
    std::int64_t all = 0;
    std::int64_t raw = 0;
    void Add(const LogEvent& event);
  };
  // Writes events to the kernel and removes them from the batch. *cost: adds theirs. Returns the
  // first error, empty if none.
  std::string WriteBatch(std::deque<LogEvent>* batch, Cost* cost);
  // Puts unwritten events back to the front of the queue.
  void TakeBack(std::deque<LogEvent> left);

  // Calls EventSink::Tidy() if it is due. Returns its error, empty if none.
  std::string TidyNow(bool after_error);

  const std::unique_ptr<EventSink> files_;  // used by the writing thread only
  const std::int64_t max_queue_bytes_;
  const std::chrono::milliseconds flush_interval_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<LogEvent> queue_;
  using Clock = std::chrono::steady_clock;
  // When the oldest event came: of those in the queue, being written, written without fsync, and in
  // the running fsync.
  std::optional<Clock::time_point> queued_since_;
  std::optional<Clock::time_point> batch_since_;
  std::optional<Clock::time_point> unsynced_since_;
  std::optional<Clock::time_point> syncing_since_;
  std::function<void()> sync_;  // the next call of fsync
  std::string write_error_;
  std::string sync_error_;
  Clock::time_point tidied_{};     // last call of Tidy(); used by the writing thread only
  std::int64_t events_taken_ = 0;  // accepted by Add()
  Cost queued_;
  Status status_;
  bool stop_ = false;
  bool stop_sync_ = false;
  std::thread writer_;
  std::thread syncer_;
};

}  // namespace seastitch
