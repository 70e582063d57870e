#include "drivers/can/can_driver.hpp"

#include <filesystem>

#include "common/convert/convert.hpp"
#include "drivers/socket/cannelloni.hpp"

namespace seastitch {
namespace {

// What one RAW_CAN message may span: replayed from it, a frame's stamp is wrong by less.
constexpr Duration kMaxPacketSpan = std::chrono::milliseconds(1);

// How often the interface went, by what its source counts.
std::int64_t OutagesIn(const Counters& source) {
  std::int64_t outages = 0;
  for (const char* name : {"can_interface_down", "can_interface_gone"})
    if (const auto counter = source.find(name); counter != source.end()) outages += counter->second;
  return outages;
}

}  // namespace

std::string CanDriverParams::Validate() const {
  if (source.empty()) return "source: missing";
  if (receive_buffer_bytes < 4096 || receive_buffer_bytes > 256 * 1024 * 1024)
    return "receive_buffer_bytes must be 4096 to 268435456";
  if (!(timeout_s > 0.0 && timeout_s <= 3600.0)) return "timeout_s must be above 0, at most 3600";
  return "";
}

CanDriver::CanDriver(const std::string& name, const CanDriverParams& params, Bus* bus)
    : bus_(bus),
      // Two drivers on one bus write RAW_CAN, each with a sequence of its own.
      raw_source_(params.source + "#" + name),
      health_(name),
      watch_(params.source, params.timeout_s, &health_) {}

void CanDriver::Feed(const CanFrame& frame, Time recv) {
  const ReceivedFrame one{frame, recv};
  Feed(std::span(&one, 1));
}

void CanDriver::Feed(std::span<const ReceivedFrame> frames) {
  for (std::size_t begin = 0; begin < frames.size();) {
    std::size_t end = begin + 1;
    while (end < frames.size() &&
           std::chrono::abs(frames[end].recv - frames[begin].recv) <= kMaxPacketSpan)
      ++end;
    PublishRaw(frames.subspan(begin, end - begin));
    begin = end;
  }
  for (const ReceivedFrame& received : frames) {
    health_.Tick("can_frames");
    if (received.frame.error) {
      errors_.Add(received.frame);
    } else {
      errors_.SeeData();
      Decode(received.frame, received.recv);
    }
  }
}

void CanDriver::PublishRaw(std::span<const ReceivedFrame> frames) {
  std::vector<CanFrame> packet;
  for (const ReceivedFrame& received : frames) packet.push_back(received.frame);
  const std::vector<std::uint8_t> bytes =
      EncodeCannelloni(packet, static_cast<std::uint8_t>(raw_seq_));
  for (const raw_bytes_t& part : ToRawParts(bytes, raw_source_, frames.back().recv, raw_seq_)) {
    bus_->Publish("RAW_CAN", part);
    ++raw_seq_;
  }
}

void CanDriver::OnPublished(const std::string& stream) {
  health_.Tick(stream);
  watch_.OnData();
}

void CanDriver::UpdateHealth(const Counters& source,
                             DeviceWatch::Clock::time_point now,
                             const std::string& trouble) {
  if (const std::int64_t outages = OutagesIn(source); outages != outages_) {
    errors_.BeginAnew();
    outages_ = outages;
  }
  SetAll(source, &health_);
  SetAll(errors_.counters(), &health_);
  SetAll(decoder_counters(), &health_);
  SetAll(clock_figures(), &health_);
  health_.Set("lcm_publish_errors", bus_->publish_errors());
  watch_.Check(now, trouble.empty() ? errors_.trouble() : trouble);
}

int RunCanDriver(CanDriver* driver, CanSource* source, Bus* bus, EventLoop* loop) {
  const auto update_health = [driver, source] {
    driver->UpdateHealth(source->counters(), DeviceWatch::Clock::now(), source->trouble());
  };
  loop->Add(source->fd(), [driver, source, loop] {
    driver->Feed(source->Receive());
    if (source->finished()) loop->Stop();
  });
  update_health();
  loop->Every(std::chrono::seconds(1), update_health);
  driver->health().PublishEverySecond(bus, loop);
  const int code = loop->Run();
  driver->Finish();
  return code;
}

CanDriverParams ReadCanDriverParams(ConfigMap* root) {
  CanDriverParams params;
  root->Require("source", &params.source);
  root->Read("receive_buffer_bytes", &params.receive_buffer_bytes);
  root->Read("timeout_s", &params.timeout_s);
  root->Check(params.Validate());
  return params;
}

ClockParams ReadClockParams(ConfigMap* root) {
  ClockParams params;
  std::string clock = "device";
  root->Read("clock", &clock);
  if (clock == "device")
    params.clock = DeviceClock::kDevice;
  else if (clock == "model")
    params.clock = DeviceClock::kModel;
  else if (clock == "receive")
    params.clock = DeviceClock::kReceive;
  else
    root->Check("clock: '" + clock + "' is not device, model or receive");
  root->Read("latency_s", &params.latency_s);
  root->Check(params.Validate());
  return params;
}

SignalMap ReadSignalMap(ConfigMap* root, const std::vector<std::string>& field_keys) {
  std::string dbc_path;
  root->Require("dbc", &dbc_path);
  Dbc dbc;
  try {
    dbc = Dbc::Load((std::filesystem::path(root->file()).parent_path() / dbc_path).string());
  } catch (const std::runtime_error& e) {
    root->Check(std::string("dbc: ") + e.what());
  }
  ConfigMap signals = root->Child("signals");
  SignalMap map;
  for (std::size_t field = 0; field < field_keys.size(); ++field) {
    std::string text;
    signals.Read(field_keys[field], &text);
    if (text.empty()) continue;
    try {
      map.Assign(dbc, field, text);
    } catch (const std::runtime_error& e) {
      signals.Check(field_keys[field] + ": " + e.what());
    }
  }
  signals.Finish();
  return map;
}

}  // namespace seastitch
