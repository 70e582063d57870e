#include "logger/log_series.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/files/durable_file.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

fs::path NextLog(const fs::path& folder) {
  std::error_code error;
  int next = 0;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const auto number = LogNumber(entry.path())) next = std::max(next, *number + 1);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
  return folder / LogName(next);
}

}  // namespace

LogSeries::LogSeries(fs::path folder, SplitParams split)
    : folder_(std::move(folder)), split_(split) {
  if (const std::optional<FileIdentity> there = IdentityOf(folder_)) device_ = there->device;
}

void LogSeries::MakeFolder() const {
  fs::path there = folder_;
  while (!fs::exists(there) && there.has_relative_path()) there = there.parent_path();
  const std::optional<FileIdentity> disk = IdentityOf(there);
  if (disk && device_ && disk->device != *device_)
    throw std::runtime_error(folder_.string() + ": is on another disk than before");
  std::error_code error;
  fs::create_directory(folder_.parent_path(), error);
  fs::create_directory(folder_, error);
}

bool LogSeries::CheckPlace() {
  if (!log_ || IdentityOf(path_) == identity_) return true;
  events_closed_ += log_->events();
  bytes_closed_ += log_->bytes();
  log_.reset();
  path_.clear();
  return false;
}

void LogSeries::Open() {
  MakeFolder();
  const fs::path path = NextLog(folder_);
  EventLogWriter log(path, IfExists::kRefuse);
  if (log_) {
    events_closed_ += log_->events();
    bytes_closed_ += log_->bytes();
  }
  log_.emplace(std::move(log));
  path_ = path;
  identity_ = IdentityOf(path);
  first_utime_.reset();
  SyncFolder(folder_);
}

void LogSeries::Write(const LogEvent& event) {
  if (log_ && IsFull(event)) {
    log_->Sync();
    Open();
  }
  if (!log_) Open();
  log_->Write(event.utime, event.channel, event.data.data(), event.data.size());
  if (!first_utime_) first_utime_ = event.utime;
}

void LogSeries::Flush() {
  if (log_) log_->Flush();
}

std::function<void()> LogSeries::Syncer() const {
  return log_ ? log_->Syncer() : [] {};
}

bool LogSeries::IsFull(const LogEvent& next) const {
  if (log_->bytes() >= split_.max_bytes) return true;
  std::int64_t span_us = 0;
  const bool overflow =
      __builtin_sub_overflow(next.utime, first_utime_.value_or(next.utime), &span_us);
  return overflow || span_us >= split_.max_us || span_us <= -split_.max_us;
}

std::int64_t LogSeries::events() const { return events_closed_ + (log_ ? log_->events() : 0); }

std::int64_t LogSeries::bytes() const { return bytes_closed_ + (log_ ? log_->bytes() : 0); }

}  // namespace seastitch
