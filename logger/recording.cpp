#include "logger/recording.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <stdexcept>

#include "common/core/channel_names.hpp"

namespace seastitch {
namespace {

bool IsReadOnly(const std::filesystem::path& folder) {
  return ::access(folder.c_str(), W_OK) != 0 && errno == EROFS;
}

}  // namespace

Recording::Recording(const DiveFolder& dive, const SplitParams& split, const QuotaParams& quota)
    : log_(dive.log(), split),
      raw_(dive.raw(), split),
      configuration_(std::make_shared<ConfigArchive>(dive.config())),
      housekeeper_(dive.path(), quota) {
  try {
    log_.Open();
  } catch (const std::runtime_error& e) {
    if (!IsReadOnly(dive.log())) throw;
    spdlog::warn("{}", e.what());
  }
}

void Recording::Write(const LogEvent& event) {
  const bool is_raw = event.channel.starts_with(channels::kRawPrefix);
  (is_raw ? raw_ : log_).Write(event);
  if (event.channel == channels::kConfig) configuration_->Add(event);
}

void Recording::Flush() {
  std::exception_ptr error;
  for (LogSeries* series : {&log_, &raw_}) {
    try {
      series->Flush();
    } catch (const std::runtime_error&) {
      error = std::current_exception();
    }
  }
  if (error) std::rethrow_exception(error);
}

std::function<void()> Recording::Syncer() {
  return [log = log_.Syncer(), raw = raw_.Syncer(), configuration = configuration_] {
    log();
    raw();
    configuration->Save();
  };
}

void Recording::Tidy() {
  for (LogSeries* series : {&log_, &raw_})
    if (!series->CheckPlace()) ++files_vanished_;
  housekeeper_.Tidy({log_.file(), raw_.file()});
}

EventSink::Figures Recording::figures() const {
  Figures figures;
  figures.events = log_.events() + raw_.events();
  figures.bytes = log_.bytes() + raw_.bytes();
  figures.file = log_.file().string();
  figures.files_deleted = housekeeper_.files_deleted();
  figures.bytes_deleted = housekeeper_.bytes_deleted();
  figures.short_of_space = housekeeper_.short_of_space();
  figures.files_vanished = files_vanished_;
  figures.config_errors = configuration_->errors();
  return figures;
}

}  // namespace seastitch
