#pragma once

#include <functional>
#include <memory>

#include "common/runtime/dive_folder.hpp"
#include "logger/config_archive.hpp"
#include "logger/event_sink.hpp"
#include "logger/housekeeper.hpp"
#include "logger/log_series.hpp"

namespace seastitch {

// What the logger puts into a dive: RAW_* into raw/, everything else into log/, the configuration
// into config/ as well.
class Recording : public EventSink {
 public:
  // Opens the next log; on a disk that is read-only, with the first event that it takes again.
  // Throws std::runtime_error "FILE: reason".
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
};

}  // namespace seastitch
