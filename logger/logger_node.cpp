#include "logger/logger_node.hpp"

#include <spdlog/spdlog.h>

#include <memory>
#include <string>
#include <utility>

#include "logger/log_files.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kMegabyte = 1'000'000;
constexpr int kSecondsToReport = 10;
// Beyond the interval at which the disk is written to.
constexpr double kDiskMayTakeS = 1.5;

}  // namespace

LoggerNode::LoggerNode(const LoggerConfig& config, const DiveFolder& dive, Bus* bus)
    : file_(NextLogFile(dive.log())),
      writer_(std::make_unique<EventLogWriter>(file_, IfExists::kRefuse),
              config.max_queue_mb * kMegabyte,
              std::chrono::milliseconds(config.flush_interval_ms)) {
  // LCM's own queue has no limit: the bytes are bounded here, where what is dropped is counted.
  bus->SubscribeEvents(
      config.channels, 0, [this](const std::string& channel, const lcm::ReceiveBuffer& buffer) {
        OnEvent(channel, buffer);
      });
  spdlog::info("recording {} to {}", config.channels, file_.string());
  health_.SetText("recording to " + file_.string());
  health_.SetRunning();
  health_.WatchAge("oldest_unwritten",
                   conditions::kDiskStalled,
                   1e-3 * config.flush_interval_ms + kDiskMayTakeS,
                   [this] { return writer_.status().oldest_s; });
}

void LoggerNode::OnEvent(const std::string& channel, const lcm::ReceiveBuffer& buffer) {
  const Bytes data(static_cast<const std::uint8_t*>(buffer.data), buffer.data_size);
  gaps_.Add(channel, data);
  writer_.Add({buffer.recv_utime, channel, {data.begin(), data.end()}});
  health_.Tick("events");
}

bool LoggerNode::RecentGrowth::Add(std::int64_t new_total) {
  seconds_since = new_total > total ? 0 : seconds_since + 1;
  total = new_total;
  return total > 0 && seconds_since < kSecondsToReport;
}

void LoggerNode::UpdateHealth() {
  const LogWriter::Status status = writer_.status();
  health_.Set("events_written", status.events_written);
  health_.Set("events_dropped", status.events_dropped);
  health_.Set("events_unloggable", status.events_unloggable);
  health_.Set("events_lost_before_logger", gaps_.total());
  for (const auto& [channel, lost] : gaps_.lost()) health_.Set("lost_" + channel, lost);
  health_.Set("write_errors", status.write_errors);
  health_.Set("queued_bytes", status.queued_bytes);
  health_.Set("file_bytes", status.file_bytes);
  std::error_code unknown;
  const std::filesystem::space_info disk =
      std::filesystem::space(std::filesystem::absolute(file_).parent_path(), unknown);
  if (!unknown) health_.Set("disk_free_mb", static_cast<std::int64_t>(disk.available / kMegabyte));

  const std::int64_t losses = status.events_dropped + gaps_.total();
  health_.HoldIf(losses_.Add(losses),
                 conditions::kMessagesNotRecorded,
                 std::to_string(gaps_.total()) + " on the way here, " +
                     std::to_string(status.events_dropped) + " for want of room");
  health_.HoldIf(unloggable_.Add(status.events_unloggable),
                 conditions::kUnloggableMessages,
                 std::to_string(status.events_unloggable));
  health_.HoldIf(!status.error.empty(),
                 conditions::kLogNotWriting,
                 std::to_string(status.queued_bytes / kMegabyte) + " MB wait, " + status.error);
}

void LoggerNode::Finish() {
  writer_.Finish();
  const LogWriter::Status status = writer_.status();
  spdlog::info("{}: {} events, {} bytes; {} dropped, {} lost on the way",
               file_.string(),
               status.events_written,
               status.file_bytes,
               status.events_dropped,
               gaps_.total());
  if (!status.error.empty()) spdlog::error("last write: {}", status.error);
}

}  // namespace seastitch
