#include "logger/logger_node.hpp"

#include <spdlog/spdlog.h>

#include <memory>
#include <string>
#include <utility>

#include "common/core/channel_names.hpp"
#include "logger/recording.hpp"
#include "seastitch/config_request_t.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kMegabyte = 1'000'000;
// Allowed delay of the disk [s], in addition to the flush interval.
constexpr double kDiskMayTakeS = 1.5;

SplitParams SplitOf(const LoggerConfig& config) {
  return {config.file_max_mb * kMegabyte, static_cast<std::int64_t>(1e6 * config.file_max_s)};
}

std::string TextOf(const std::filesystem::path& file) {
  return file.empty() ? "no log is open yet" : "recording to " + file.string();
}

QuotaParams QuotaOf(const LoggerConfig& config) {
  return {config.dive_max_mb * kMegabyte, config.disk_min_free_mb * kMegabyte, config.delete_logs};
}

}  // namespace

LoggerNode::LoggerNode(const LoggerConfig& config, const DiveFolder& dive, Bus* bus)
    : bus_(bus),
      dive_(dive.path()),
      writer_(std::make_unique<Recording>(dive, SplitOf(config), QuotaOf(config)),
              config.max_queue_mb * kMegabyte,
              std::chrono::milliseconds(config.flush_interval_ms)),
      file_(writer_.status().files.file) {
  // No limit of LCM's own queue (0): the writer limits the bytes and counts what it drops.
  bus->SubscribeEvents(
      config.channels, 0, [this](const std::string& channel, const lcm::ReceiveBuffer& buffer) {
        OnEvent(channel, buffer);
      });
  spdlog::info("{}, channels {}", TextOf(file_), config.channels);
  health_.Set(HealthValue::kDiveStart, ReadDiveRecord(dive.path()).start_utime);
  health_.SetText(TextOf(file_));
  health_.SetRunning();
  health_.WatchAge("oldest_unwritten",
                   conditions::kDiskStalled,
                   1e-3 * config.flush_interval_ms + kDiskMayTakeS,
                   [this] { return writer_.status().oldest_s; });
}

void LoggerNode::OnEvent(const std::string& channel, const lcm::ReceiveBuffer& buffer) {
  const Bytes data(static_cast<const std::uint8_t*>(buffer.data), buffer.data_size);
  gaps_.Add(channel, data);
  if (foreign_.Add(channel, data, buffer.recv_utime)) health_.Tick("foreign_" + channel);
  writer_.Add({buffer.recv_utime, channel, {data.begin(), data.end()}});
  health_.Tick("events");
}

void LoggerNode::UpdateHealth(double now_s) {
  const LogWriter::Status status = writer_.status();
  health_.Set("events_written", status.events_written);
  health_.Set(HealthValue::kEventsDropped, status.events_dropped);
  health_.Set("events_unloggable", status.events_unloggable);
  health_.Set("events_lost_before_logger", gaps_.total());
  for (const auto& [channel, lost] : gaps_.lost()) health_.Set("lost_" + channel, lost);
  health_.Set("write_errors", status.write_errors);
  health_.Set("queued_bytes", status.queued_bytes);
  health_.Set("file_bytes", status.files.bytes);
  health_.Set("files_deleted", status.files.files_deleted);
  health_.Set("files_vanished", status.files.files_vanished);
  health_.FollowEvents(conditions::kLogVanished, status.files.files_vanished, now_s);
  health_.Set("config_write_errors", status.files.config_errors);
  for (const auto& [channel, figures] : foreign_.figures()) {
    health_.Set("foreign_" + channel, figures.events);
    health_.Set("foreign_" + channel + "_longest_gap_ms", figures.longest_gap_us / 1000);
  }
  std::error_code unknown;
  const std::filesystem::space_info disk = std::filesystem::space(dive_, unknown);
  if (!unknown)
    health_.Set(HealthValue::kDiskFree, static_cast<std::int64_t>(disk.available / kMegabyte));

  health_.FollowEvents(conditions::kMessagesNotRecorded,
                       status.events_dropped + gaps_.total(),
                       now_s,
                       std::to_string(gaps_.total()) + " on the way here, " +
                           std::to_string(status.events_dropped) + " for want of room");
  health_.FollowEvents(conditions::kUnloggableMessages,
                       status.events_unloggable,
                       now_s,
                       std::to_string(status.events_unloggable));
  health_.HoldIf(!status.error.empty(),
                 conditions::kLogNotWriting,
                 std::to_string(status.queued_bytes / kMegabyte) + " MB wait, " + status.error);
  health_.FollowEvents(conditions::kRecordingsDeleted,
                       status.files.files_deleted,
                       now_s,
                       std::to_string(status.files.files_deleted) + " files, " +
                           std::to_string(status.files.bytes_deleted / kMegabyte) + " MB");
  health_.HoldIf(status.files.short_of_space, conditions::kDiskSpaceLow);
  if (status.files.file != file_) {
    file_ = status.files.file;
    health_.SetText(TextOf(file_));
    RequestConfiguration();
  }
}

void LoggerNode::RequestConfiguration() {
  config_request_t request{};
  request.utime = NowUtime();
  request.seq = request_seq_++;
  request.sender = "logger";
  bus_->Publish(channels::kConfigRequest, request);
}

void LoggerNode::Finish() {
  writer_.Finish();
  const LogWriter::Status status = writer_.status();
  spdlog::info("{}: {} events, {} bytes; {} dropped, {} lost on the way",
               dive_.string(),
               status.events_written,
               status.files.bytes,
               status.events_dropped,
               gaps_.total());
  if (!status.error.empty()) spdlog::error("last write: {}", status.error);
}

}  // namespace seastitch
