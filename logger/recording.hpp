#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "common/runtime/files/dive_folder.hpp"
#include "logger/config_archive.hpp"
#include "logger/event_sink.hpp"
#include "logger/housekeeper.hpp"
#include "logger/log_series.hpp"

namespace seastitch {

// The files of one dive: messages of RAW_* channels (raw bytes of devices) go to raw/, all others
// to log/. Configuration messages also go to config/, as files.
class Recording : public EventSink {
 public:
  // Opens the next file of log/; that of raw/ is opened by its first event. On a read-only disk
  // that of log/ too. Files are numbered after the existing ones. Throws std::runtime_error "FILE:
  // reason".
  Recording(const DiveFolder& dive, const SplitParams& split, const QuotaParams& quota);

  void Write(const LogEvent& event) override;
  void Flush() override;
  std::function<void()> Syncer() override;
  void Tidy() override;
  Figures figures() const override;

 private:
  LogSeries log_;
  LogSeries raw_;
  const std::shared_ptr<ConfigArchive> configuration_;
  Housekeeper housekeeper_;
  std::int64_t files_vanished_ = 0;
};

}  // namespace seastitch
