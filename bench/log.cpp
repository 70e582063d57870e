#include "bench/log.hpp"

#include <vector>

#include "bench/truth.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/process/process.hpp"
#include "common/storage/event_log.hpp"

namespace seastitch::bench {
namespace {

std::vector<ReceivedFrame> WithStamp(const std::vector<CanFrame>& frames, Time recv) {
  std::vector<ReceivedFrame> received;
  received.reserve(frames.size());
  for (const CanFrame& frame : frames) received.push_back({frame, recv});
  return received;
}

}  // namespace

DriverConfigs LoadDriverConfigs(const std::filesystem::path& folder) {
  return {LoadImuDriverConfig((folder / "imu_driver.yaml").string()),
          LoadDvlDriverConfig((folder / "dvl_driver.yaml").string()),
          LoadMbesDriverConfig((folder / "mbes_driver.yaml").string())};
}

LogResult WriteLog(SurveySimulator* simulator,
                   const DriverConfigs& drivers,
                   std::vector<config_t> configuration,
                   const std::filesystem::path& path,
                   const Progress& progress) {
  EventLogWriter writer(path);
  LogResult result;
  Time now = simulator->start();
  const auto write = [&](const std::string& channel, const void* data, std::size_t size) {
    writer.Write(ToUtime(now), channel, data, size);
    ++result.events;
    ++result.channels[channel];
  };
  // One each, as every process numbers its own messages.
  MessageOutput from_imu(write), from_dvl(write), from_mbes(write), own(write);
  for (config_t& part : configuration) {
    part.utime = ToUtime(now);
    part.version = ProgramVersion();
    own.Send(channels::kConfig, part);
  }
  ImuDriver imu(drivers.imu, &from_imu);
  DvlDriver dvl(drivers.dvl, &from_dvl);
  MbesDriver mbes(drivers.mbes, &from_mbes);

  const double total_s = ToSeconds(simulator->total());
  Time next_progress = simulator->start();
  while (const std::optional<BenchEvent> event = simulator->Next()) {
    now = event->recv;
    switch (event->device) {
      case Device::kImu: imu.Feed(WithStamp(event->frames, now)); break;
      case Device::kDvl: dvl.Feed(WithStamp(event->frames, now)); break;
      case Device::kMbes: mbes.Feed(Datagram{event->bytes, now}); break;
      case Device::kFix: own.Put(*event->fix, now); break;
    }
    if (progress && now >= next_progress) {
      if (!progress(ToSeconds(now - simulator->start()) / total_s)) break;
      next_progress = now + std::chrono::seconds(1);
    }
  }
  imu.Finish();
  dvl.Finish();
  writer.Flush();
  WriteTruth(*simulator, TruthPathFor(path));
  return result;
}

}  // namespace seastitch::bench
