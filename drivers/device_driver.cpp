#include "drivers/device_driver.hpp"

#include <chrono>
#include <stdexcept>
#include <utility>
#include <variant>

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {

void DeclareDevice(std::string* device,
                   const std::vector<std::string>& names,
                   ParameterTable* table) {
  table
      ->AddChoice("device",
                  device,
                  names,
                  "Data format of the device. The keys below belong to the format named here.")
      .DataSheet();
}

void DeclareDriver(DriverParams* params, ParameterTable* table) {
  table
      ->Add("source",
            &params->source,
            "URL of the bytes. Device on CAN: can:can0, candump:FILE?speed=1, or udp:HOST:PORT for "
            "a cannelloni gateway. PD0 or sonar: udp:HOST:PORT. Sonar with a TCP server (wbms): "
            "tcp:HOST:PORT. HOST of udp is the local address (0.0.0.0: all) or a multicast group; "
            "?interface=eth1 names the interface of the group, ?from=10.0.0.5,10.0.0.6 the "
            "accepted senders.")
      .DataSheet()
      .Required();
  table->Add("receive_buffer_bytes",
             &params->receive_buffer_bytes,
             Unit::kByte,
             Range::Within(65'536, 256 * 1024 * 1024),
             "Receive buffer of the socket, at most net.core.rmem_max. Increase it when "
             "can_frames_dropped or udp_dropped rises.");
  table->Add("timeout_s",
             &params->timeout_s,
             Unit::kSecond,
             Range::Above(0.0).AtMost(3600.0),
             "Time without a measurement after which HEALTH reports the device as lost.");
}

void CheckSource(const std::string& config_file, const DriverParams& params, SourceKind kind) {
  try {
    ExpectUsable(params.source, kind);
  } catch (const std::runtime_error& e) {
    throw ConfigError(config_file + ": source: " + e.what());
  }
}

void DeclareClock(ClockParams* params, bool has_clock, ParameterTable* table) {
  const Parameter& clock =
      table
          ->AddChoice<DeviceClock>(
              "clock",
              &params->clock,
              {{"device", DeviceClock::kDevice},
               {"model", DeviceClock::kModel},
               {"receive", DeviceClock::kReceive}},
              "Clock of utime, the time of a measurement. device: the device's own time, which "
              "must be UTC; model: the device's clock or counter, mapped to the computer's clock "
              "by a model of offset and drift; receive: the kernel's receive stamp minus "
              "latency_s.")
          .DataSheet();
  if (!has_clock)
    table->AddRule(clock, "receive: this device sends no time of measurement", [params] {
      return params->clock == DeviceClock::kReceive;
    });
  table->Add("latency_s",
             &params->latency_s,
             Unit::kSecond,
             Range::AtLeast(0.0).Below(10.0),
             "Delay from the measurement to its reception, subtracted from the receive stamp. With "
             "clock: model the minimum delay (of a multibeam ping from the last echo). With clock: "
             "device used only for messages without a time.");
}

std::string DeviceIn(const std::string& path, const std::vector<std::string>& names) {
  std::string device = names.front();
  ParameterTable table;
  DeclareDevice(&device, names, &table);
  PeekParameters(path, table);
  return device;
}

namespace {

const char* ChannelOf(const ImuSample&) { return channels::kImu; }
const char* ChannelOf(const DvlSample&) { return channels::kDvl; }
const char* ChannelOf(const DepthSample&) { return channels::kDepth; }
const char* ChannelOf(const NavigationSample&) { return channels::kIns; }
const char* ChannelOf(const PositionFix&) { return channels::kPositionFix; }
const char* ChannelOf(const MbesPing&) { return channels::kMbesPing; }
const char* ChannelOf(const SoundingPing&) { return channels::kMbesSoundings; }
const char* ChannelOf(const SoundVelocityProfile&) { return channels::kSvp; }

}  // namespace

void MessageOutput::Put(Sample sample, Time recv) {
  std::visit(
      Overloaded{[](const Heartbeat&) {},
                 [&](const SoundingPing& ping) {
                   std::int64_t& seq = seqs_[ChannelOf(ping)];
                   for (const mbes_soundings_t& part : ToLcm(ping, MessageStamp{recv, seq})) {
                     Send(ChannelOf(ping), part);
                     ++seq;
                   }
                 },
                 [&](const auto& s) {
                   Send(ChannelOf(s), ToLcm(s, MessageStamp{recv, seqs_[ChannelOf(s)]++}));
                 }},
      sample);
}

void MessageOutput::Put(const RawBytes& raw) {
  const std::string channel(raw.channel);
  std::int64_t& seq = seqs_[channel];
  for (const raw_bytes_t& part : ToRawParts(raw.bytes, std::string(raw.source), raw.recv, seq)) {
    Send(channel, part);
    ++seq;
  }
}

DeviceDriver::DeviceDriver(const std::string& name,
                           const std::string& raw_channel,
                           const std::string& raw_source,
                           const DriverParams& params,
                           DriverOutput* output)
    : output_(output),
      params_(params),
      raw_channel_(raw_channel),
      raw_source_(raw_source),
      health_(name),
      watch_(params.source, params.timeout_s, &health_) {}

void DeviceDriver::Put(Sample sample, Time recv, const std::string& stream) {
  PutAside(std::move(sample), recv, stream);
  watch_.OnData();
}

void DeviceDriver::PutAside(Sample sample, Time recv, const std::string& stream) {
  output_->Put(std::move(sample), recv);
  health_.Tick(stream);
}

void DeviceDriver::UpdateHealth(const Counters& source,
                                DeviceWatch::Clock::time_point now,
                                const std::string& trouble,
                                const SenderRefusal& refusal) {
  SetAll(source, &health_);
  SetAll(decoder_counters(), &health_);
  SetAll(clock_figures(), &health_);
  watch_.Check(now, trouble);
  FollowRefusals(refusal, now, &health_);
}

int DeviceDriver::Run(int fd,
                      const std::function<void()>& feed,
                      const std::function<void()>& update_health,
                      Bus* bus,
                      EventLoop* loop) {
  loop->Add(fd, feed);
  update_health();
  loop->Every(std::chrono::seconds(1), update_health);
  health_.PublishEverySecond(bus, loop);
  return loop->Run();
}

}  // namespace seastitch
