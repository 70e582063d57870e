#include "logger/log_writer.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <utility>

#include "common/core/channel_names.hpp"

namespace seastitch {
namespace {

constexpr auto kTidyEvery = std::chrono::seconds(1);

bool IsRaw(const LogEvent& event) { return event.channel.starts_with(channels::kRawPrefix); }

}  // namespace

// Memory that an event takes in the queue, with its strings and pointers.
void LogWriter::Cost::Add(const LogEvent& event) {
  constexpr std::int64_t kOverhead = 128;
  const auto bytes =
      kOverhead + static_cast<std::int64_t>(event.channel.size() + event.data.size());
  all += bytes;
  if (IsRaw(event)) raw += bytes;
}

LogWriter::LogWriter(std::unique_ptr<EventSink> files,
                     std::int64_t max_queue_bytes,
                     std::chrono::milliseconds flush_interval)
    : files_(std::move(files)), max_queue_bytes_(max_queue_bytes), flush_interval_(flush_interval) {
  status_.files = files_->figures();
  writer_ = std::thread([this] { WriteMain(); });
  syncer_ = std::thread([this] { SyncMain(); });
}

LogWriter::~LogWriter() { Finish(); }

void LogWriter::Add(LogEvent event) {
  const std::lock_guard lock(mutex_);
  if (!IsLoggable(event.channel, event.data.size())) {
    ++status_.events_unloggable;
    return;
  }
  Cost cost = queued_;
  cost.Add(event);
  if (cost.all > max_queue_bytes_ || cost.raw > max_queue_bytes_ / 4 * 3) {
    ++status_.events_dropped;
    return;
  }
  queued_ = cost;
  status_.queued_bytes = queued_.all;
  ++events_taken_;
  if (!queued_since_) queued_since_ = Clock::now();
  queue_.push_back(std::move(event));
}

LogWriter::Status LogWriter::status() const {
  const std::lock_guard lock(mutex_);
  Status status = status_;
  for (const auto& since : {syncing_since_, unsynced_since_, batch_since_, queued_since_})
    if (since)
      status.oldest_s =
          std::max(status.oldest_s, std::chrono::duration<double>(Clock::now() - *since).count());
  status.error = write_error_.empty() ? sync_error_ : write_error_;
  return status;
}

void LogWriter::Finish() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  if (writer_.joinable()) writer_.join();
  {
    const std::lock_guard lock(mutex_);
    stop_sync_ = true;
  }
  wake_.notify_all();
  if (syncer_.joinable()) syncer_.join();
}

void LogWriter::WriteMain() {
  std::unique_lock lock(mutex_);
  bool last = false;
  while (!last) {
    // Writes at regular times, with or without traffic: the last messages must reach the disk, too.
    // Writing to the kernel is cheap, and is done more often than flushing to the disk.
    wake_.wait_for(lock, std::chrono::microseconds(flush_interval_) / 8, [this] { return stop_; });
    last = stop_;
    std::deque<LogEvent> batch = std::exchange(queue_, {});
    batch_since_ = std::exchange(queued_since_, std::nullopt);
    lock.unlock();
    Cost cost;
    std::string error = WriteBatch(&batch, &cost);
    const bool written = error.empty();
    const std::string tidy_error = TidyNow(!written);
    if (error.empty()) error = tidy_error;
    EventSink::Figures figures = files_->figures();
    std::function<void()> sync = files_->Syncer();
    lock.lock();
    TakeBack(std::move(batch));
    sync_ = std::move(sync);
    const auto since = std::exchange(batch_since_, std::nullopt);
    // After a failure some events still wait, and the events in the file may not be flushed.
    if (!written && since) queued_since_ = since;
    if (written && since && !unsynced_since_) unsynced_since_ = since;
    queued_.all -= cost.all;
    queued_.raw -= cost.raw;
    status_.queued_bytes = queued_.all;
    status_.files = std::move(figures);
    status_.events_written = status_.files.events;
    status_.write_errors += error.empty() ? 0 : 1;
    write_error_ = std::move(error);
  }
  status_.events_dropped += events_taken_ - status_.events_written;
}

void LogWriter::SyncMain() {
  std::unique_lock lock(mutex_);
  bool last = false;
  while (!last) {
    wake_.wait_for(lock, flush_interval_, [this] { return stop_sync_; });
    last = stop_sync_;
    if (unsynced_since_) SyncOnce(&lock);
  }
}

void LogWriter::SyncOnce(std::unique_lock<std::mutex>* lock) {
  const std::function<void()> sync = sync_;
  syncing_since_ = std::exchange(unsynced_since_, std::nullopt);
  lock->unlock();
  std::string error;
  try {
    sync();
  } catch (const std::exception& e) {
    error = e.what();
  }
  lock->lock();
  const auto since = std::exchange(syncing_since_, std::nullopt);
  if (!error.empty()) {
    unsynced_since_ = since;
    ++status_.write_errors;
  }
  sync_error_ = std::move(error);
}

std::string LogWriter::WriteBatch(std::deque<LogEvent>* batch, Cost* cost) {
  std::string error;
  const auto tried = [&error](const auto& write) {
    try {
      write();
      return true;
    } catch (const std::exception& e) {
      if (error.empty()) error = e.what();
      return false;
    }
  };
  std::deque<LogEvent> left;
  std::array<bool, 2> failed{};  // of others, of raw bytes
  for (LogEvent& event : *batch) {
    bool& has_failed = failed[IsRaw(event) ? 1 : 0];
    has_failed = has_failed || !tried([&] { files_->Write(event); });
    if (has_failed)
      left.push_back(std::move(event));
    else
      cost->Add(event);
  }
  *batch = std::move(left);
  tried([&] { files_->Flush(); });
  return error;
}

std::string LogWriter::TidyNow(bool after_error) {
  if (!after_error && Clock::now() - tidied_ < kTidyEvery) return "";
  tidied_ = Clock::now();
  try {
    files_->Tidy();
    return "";
  } catch (const std::exception& e) {
    return e.what();
  }
}

void LogWriter::TakeBack(std::deque<LogEvent> left) {
  std::move(queue_.begin(), queue_.end(), std::back_inserter(left));
  queue_ = std::move(left);
}

}  // namespace seastitch
