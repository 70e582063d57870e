#include "drivers/output/nav_output_node.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "drivers/device_watch.hpp"

namespace seastitch {
namespace {

// NAV comes at 10 Hz or more, the Doppler log's altitude at 1 Hz or more.
constexpr double kNavHoldsS = 1.0;
constexpr double kAltitudeHoldsS = 3.0;
constexpr double kBitsPerByte = 10.0;  // of a serial port, with start and stop bit

ParameterTable& DeclareRates(NavSentencesParams* rates, ParameterTable* table) {
  ParameterTable& section = table->AddSection(
      "rates",
      "Sentences a second. A sentence is sent with the first NAV of each period; NAV has 10 to 50 "
      "Hz. 0: not sent.");
  const auto add = [&section](const char* key, double* hz, const char* sentence) {
    section.Add(key, hz, Unit::kHertz, Range::Within(0.0, 50.0), sentence).DataSheet();
  };
  add("gga_hz", &rates->gga_hz, "Position; its altitude is minus the depth.");
  add("rmc_hz", &rates->rmc_hz, "Position, course and speed over ground, date.");
  add("gst_hz", &rates->gst_hz, "Errors of the position, 1 sigma.");
  add("hdt_hz", &rates->hdt_hz, "Heading from true north.");
  add("vtg_hz", &rates->vtg_hz, "Course and speed over ground.");
  add("dpt_hz",
      &rates->dpt_hz,
      "Altitude above the bottom, as the Doppler log has it; its offset is the depth of the "
      "vehicle.");
  add("zda_hz", &rates->zda_hz, "Date and time.");
  return section;
}

bool IsTalker(const std::string& text) {
  const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  return text.size() == 2 && std::all_of(text.begin(), text.end(), is_capital);
}

void CheckOutput(const std::string& path, const char* key, const std::string& url) {
  if (url.empty()) return;
  try {
    ExpectSink(url);
    if (!url.starts_with(std::string(key) + ":"))
      throw std::runtime_error(url + ": expected " + key + ":...");
  } catch (const std::runtime_error& e) {
    throw ConfigError(path + ": " + key + ": " + e.what());
  }
}

void CheckLoad(const std::string& path, const NavOutputConfig& config) {
  if (config.serial.empty()) return;
  const double wanted = BytesPerSecondOf(config.sentences);
  const double has = BaudOf(ParseSourceUrl(config.serial, {"baud"})) / kBitsPerByte;
  if (wanted <= has) return;
  char text[160];
  std::snprintf(text,
                sizeof text,
                ": the sentences of rates are up to %.0f bytes a second, and the port takes %.0f: "
                "expected a higher baud or lower rates",
                wanted,
                has);
  throw ConfigError(path + ": serial: " + config.serial + text);
}

const NavState& StateIn(const NavState& state) { return state; }
const NavState& StateIn(const CorrectedNavState& corrected) { return corrected.state; }

}  // namespace

ParameterTable TableOf(NavOutputConfig* config) {
  ParameterTable table;
  table
      .Add("udp",
           &config->udp,
           "Receiver of the sentences: udp:HOST:PORT, a host, a broadcast address or a multicast "
           "group (?interface=eth1). As a service the process reaches only this computer: another "
           "address needs a drop-in (docs/listening.md). Empty: none.")
      .DataSheet();
  table
      .Add("serial",
           &config->serial,
           "Serial port for the sentences: serial:/dev/ttyUSB0?baud=38400 (4800 without baud). "
           "Empty: none.")
      .DataSheet();
  table
      .AddChoice("navigation",
                 &config->corrected,
                 {{channels::kNavCorrected, true}, {channels::kNav, false}},
                 "The navigation that is sent. NAV_CORRECTED is in the solved map and jumps when a "
                 "solution moves the vehicle; NAV is dead reckoning, which drifts and never jumps.")
      .DataSheet();
  DeclareVehicleFile(&config->vehicle_file, &table);
  NavSentencesParams* const sentences = &config->sentences;
  const Parameter& talker = table.Add(
      "talker",
      &sentences->talker,
      "First two letters of each sentence: IN for integrated navigation, GP where a receiver of "
      "the sentences knows nothing but GPS.");
  table.AddRule(talker, "two capital letters", [sentences] { return IsTalker(sentences->talker); });
  table.Add("fix_sigma_m",
            &sentences->fix_sigma_m,
            Unit::kMetre,
            Range::Within(0.0, 10'000.0),
            "Horizontal 1 sigma up to which GGA has quality 1, a position fix. Above it GGA has "
            "quality 6, an estimate, which some autopilots refuse.");
  table.Add("position_sigma_max_m",
            &sentences->position_sigma_max_m,
            Unit::kMetre,
            Range::Within(0.1, 100'000.0),
            "Horizontal 1 sigma above which no position is sent: GGA has quality 0. A vehicle that "
            "does not know where it started has a sigma of 1 km.");
  DeclareRates(sentences, &table);
  return table;
}

NavOutputConfig LoadNavOutputConfig(const std::string& path) {
  NavOutputConfig config;
  LoadParameters(path, TableOf(&config));
  CheckOutput(path, "udp", config.udp);
  CheckOutput(path, "serial", config.serial);
  CheckLoad(path, config);
  config.vehicle = LoadVehicleBeside(path, &config.vehicle_file);
  return config;
}

std::string PrintConfig(const NavOutputConfig& config) { return PrintWithDefaults(config, {}); }

std::vector<std::pair<std::string, std::string>> ConfigFiles(const NavOutputConfig& config) {
  NavOutputConfig published = config;
  published.vehicle_file = config.vehicle_file.filename();
  return {{"nav_output.yaml", PrintConfig(published)},
          {"vehicle.yaml", PrintConfig(config.vehicle)}};
}

std::vector<std::string> NavOutputConfig::outputs() const {
  std::vector<std::string> urls;
  for (const std::string& url : {udp, serial})
    if (!url.empty()) urls.push_back(url);
  return urls;
}

template <class Msg>
void NavOutputNode::OnMessage(const char* channel, Bus* bus) {
  bus->Subscribe<Msg>(channel, QueueOf(channel), [this](const Msg& msg) {
    if (const auto sample = FromLcm(msg))
      Send(StateIn(*sample));
    else
      health_.Count("nav_rejected");
  });
}

NavOutputNode::NavOutputNode(const NavOutputConfig& config, Bus* bus)
    : channel_(config.corrected ? channels::kNavCorrected : channels::kNav),
      dvl_below_m_(config.vehicle.T_vehicle_dvl.translation().z()),
      sentences_(config.sentences, MapFrame(DatumOf(config.vehicle))) {
  std::string to;
  for (const std::string& url : config.outputs()) {
    sinks_.push_back({url, OpenByteSink(url)});
    to += (to.empty() ? "" : ", ") + url;
  }
  health_.SetText(channel_ + " to " + to);
  health_.SetStarting("waiting for " + channel_);
  if (config.corrected)
    OnMessage<nav_corrected_t>(channels::kNavCorrected, bus);
  else
    OnMessage<nav_t>(channels::kNav, bus);
  bus->Subscribe<dvl_t>(channels::kDvl, QueueOf(channels::kDvl), [this](const dvl_t& msg) {
    const auto received = FromLcm(msg);
    if (!received || !received->altitude_m) return;
    altitude_m_ = *received->altitude_m + dvl_below_m_;
    altitude_s_ = MonotonicSeconds();
  });
}

void NavOutputNode::Send(const NavState& state) {
  heard_s_ = MonotonicSeconds();
  if (*heard_s_ - altitude_s_ > kAltitudeHoldsS) altitude_m_.reset();
  health_.Tick("nav");
  health_.SetRunning();
  health_.Release(conditions::kNavNotHeard);
  const std::string lines = sentences_.Add(state, altitude_m_);
  health_.HoldIf(!sentences_.has_position(), conditions::kPositionNotSent);
  if (lines.empty()) return;
  for (const auto& [url, sink] : sinks_) sink->Send(lines);
  for (const char c : lines)
    if (c == '\n') health_.Tick("sentences");
}

void NavOutputNode::Check() {
  const double now_s = MonotonicSeconds();
  if (!heard_s_) heard_s_ = now_s;
  if (now_s - *heard_s_ > kNavHoldsS) {
    char text[80];
    std::snprintf(
        text, sizeof text, "%s for %.0f s", channel_.c_str(), std::floor(now_s - *heard_s_));
    health_.Hold(conditions::kNavNotHeard, text);
    health_.SetRunning();
  }
  std::string troubles;
  for (const auto& [url, sink] : sinks_) {
    sink->Check();
    SetAll(sink->counters(), &health_);
    const std::string trouble = sink->trouble();
    if (!trouble.empty()) troubles += (troubles.empty() ? "" : "; ") + url + ": " + trouble;
  }
  health_.HoldIf(!troubles.empty(), conditions::kOutputUnavailable, troubles);
}

}  // namespace seastitch
