#include "drivers/can/can_driver.hpp"

#include <filesystem>
#include <optional>
#include <stdexcept>

#include "common/core/channel_names.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/files/whole_file.hpp"
#include "drivers/socket/cannelloni.hpp"

namespace seastitch {

// Two drivers on one bus both publish RAW_CAN, each with its own sequence numbers.
CanDriver::CanDriver(const std::string& name, const DriverParams& params, DriverOutput* output)
    : DeviceDriver(name, channels::kRawCan, params.source + "#" + name, params, output) {}

void CanDriver::Feed(const CanFrame& frame, Time recv) {
  const ReceivedFrame one{frame, recv};
  Feed(std::span(&one, 1));
}

void CanDriver::Feed(std::span<const ReceivedFrame> frames) {
  for (const StampedPacket& packet : PackReceived(frames, packets_)) {
    PutRaw(packet.bytes, packet.recv);
    ++packets_;
  }
  for (const ReceivedFrame& received : frames) {
    health().Tick("can_frames");
    if (received.frame.error) {
      errors_.Add(received.frame);
    } else {
      errors_.SeeData();
      Decode(received.frame, received.recv);
    }
  }
}

void CanDriver::UpdateHealth(const Counters& source,
                             DeviceWatch::Clock::time_point now,
                             const std::string& trouble,
                             const SenderRefusal& refusal) {
  SetAll(errors_.counters(), &health());
  const std::string on_the_wire = errors_.trouble();
  health().HoldIf(!on_the_wire.empty(), conditions::kCanController, on_the_wire);
  DeviceDriver::UpdateHealth(source, now, trouble, refusal);
}

int Run(CanDriver* driver, Bus* bus, EventLoop* loop) {
  const DriverParams& params = driver->params();
  const auto source = OpenCanSource(params.source, driver->filters(), params.receive_buffer_bytes);
  const auto feed = [driver, &source, loop] {
    driver->Feed(source->Receive());
    if (source->finished()) loop->Stop();
  };
  const auto update_health = [driver, &source] {
    driver->SeeOutages(source->outages());
    driver->UpdateHealth(
        source->counters(), DeviceWatch::Clock::now(), source->trouble(), source->refusal());
  };
  const int code = driver->Run(source->fd(), feed, update_health, bus, loop);
  driver->Finish();
  return code;
}

void DeclareSignals(const std::vector<std::string>& field_keys,
                    SignalFile* file,
                    ParameterTable* table) {
  table->Add("dbc", &file->dbc, "DBC file of the device's messages, relative to this file.")
      .DataSheet()
      .Required();
  ParameterTable& signals = table->AddSection(
      "signals",
      "CAN signal of each field: MESSAGE.SIGNAL, or MESSAGE.SIGNAL * FACTOR [+ OFFSET] to reverse "
      "an axis or to convert a unit. Axes are forward, starboard, down. Fields, signs, and which "
      "are required: docs/drivers.md, Signals.");
  file->texts.resize(field_keys.size());
  for (std::size_t i = 0; i < field_keys.size(); ++i)
    signals.Add(field_keys[i], &file->texts[i], "");
}

SignalMap LoadSignals(const std::string& config_path,
                      const std::vector<std::string>& field_keys,
                      SignalFile* file) {
  namespace fs = std::filesystem;
  file->dbc = (fs::absolute(config_path).parent_path() / file->dbc).lexically_normal().string();
  SignalMap map;
  std::string key = "dbc";
  try {
    const Dbc dbc = Dbc::Load(file->dbc);
    for (std::size_t field = 0; field < field_keys.size(); ++field) {
      key = "signals." + field_keys[field];
      if (!file->texts[field].empty()) map.Assign(dbc, field, file->texts[field]);
    }
  } catch (const std::runtime_error& e) {
    throw ConfigError(config_path + ": " + key + ": " + e.what());
  }
  return map;
}

std::string TextOfDbc(const std::filesystem::path& dbc) {
  std::optional<std::string> text = ReadWholeFile(dbc);
  if (!text) throw std::runtime_error(dbc.string() + ": cannot be read");
  return *std::move(text);
}

void DeclareSourceAddress(int* address, ParameterTable* table) {
  table->Add("source_address",
             address,
             Unit::kNone,
             Range::Within(-1, 251),
             "Address of the device on the bus; -1: any.");
}

}  // namespace seastitch
