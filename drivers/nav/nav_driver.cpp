#include "drivers/nav/nav_driver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "common/core/channel_names.hpp"
#include "common/runtime/config/parameter_file.hpp"
#include "drivers/can/can_driver.hpp"
#include "drivers/device_driver.hpp"
#include "drivers/nav/ins_frames.hpp"
#include "drivers/registry.hpp"

namespace seastitch {
namespace {

struct InsFormat {
  const char* name;
  SourceKind source;
  std::unique_ptr<NavCodec> (*make)(const NavDriverConfig& config);
};

constexpr InsFormat kInsFormats[] = {
    {"nmea",
     SourceKind::kBytes,
     [](const NavDriverConfig& c) -> std::unique_ptr<NavCodec> {
       NmeaInsParams params = c.ins_nmea;
       params.needs_checksum = c.needs_checksum;
       return std::make_unique<NmeaIns>(params);
     }},
    {"phins",
     SourceKind::kBytes,
     [](const NavDriverConfig& c) -> std::unique_ptr<NavCodec> {
       return std::make_unique<PhinsIns>(
           PhinsInsParams{c.ins_nmea.clock, c.altitude_is_depth, c.depth_codec.sigma_m});
     }},
    {"kmb",
     SourceKind::kBytes,
     [](const NavDriverConfig& c) -> std::unique_ptr<NavCodec> {
       return std::make_unique<KmBinaryIns>(c.ins_nmea.clock);
     }},
    {"sbg_ecan",
     SourceKind::kCan,
     [](const NavDriverConfig& c) -> std::unique_ptr<NavCodec> {
       return std::make_unique<EcanIns>(
           EcanInsParams{c.ins_signals, c.ins_nmea.clock, c.altitude_is_depth});
     }},
};

// --- configuration -------------------------------------------------------------------------------

ParameterTable& DeclareDevice(const char* name,
                              const char* sentence,
                              NavDeviceParams* device,
                              ParameterTable* table) {
  ParameterTable& section = table->AddSection(name, sentence);
  section
      .Add(
          "source",
          &device->source,
          "URL of the instrument's bytes: udp:HOST:PORT (options as for the sonar), tcp:HOST:PORT, "
          "serial:/dev/ttyUSB0?baud=4800 "
          "or, for an INS on CAN, can:can0. Several instruments may share one URL. Empty: no such "
          "instrument.")
      .DataSheet();
  section.Add(
      "timeout_s",
      &device->timeout_s,
      Unit::kSecond,
      Range::AtLeast(0.0).AtMost(3600.0),
      "Time without a message after which HEALTH reports the instrument as lost. 0: never.");
  return section;
}

void DeclareFixes(NmeaFixParams* fixes, const char* sigma_sentence, ParameterTable* section) {
  DeclareClock(&fixes->clock, true, section);
  section
      ->Add("sigma_m", &fixes->sigma_m, Unit::kMetre, Range::Within(0.01, 1000.0), sigma_sentence)
      .DataSheet();
  section->Add("interval_s",
               &fixes->interval_s,
               Unit::kSecond,
               Range::Within(0.0, 3600.0),
               "Minimum time between two published fixes. Those between are dropped, because their "
               "errors are correlated.");
}

void DeclareDepth(DepthCodecParams* depth, ParameterTable* section) {
  DeclareClock(&depth->clock, false, section);
  section
      ->Add("sigma_m",
            &depth->sigma_m,
            Unit::kMetre,
            Range::Within(0.001, 10.0),
            "Error of the depth, 1 sigma.")
      .DataSheet();
  section
      ->AddChoice<PressureUnit>(
          "pressure_unit",
          &depth->unit,
          {{"psi", PressureUnit::kPsi},
           {"hPa", PressureUnit::kHectopascal},
           {"bar", PressureUnit::kBar},
           {"dbar", PressureUnit::kDecibar},
           {"kPa", PressureUnit::kKilopascal},
           {"MPa", PressureUnit::kMegapascal},
           {"inHg", PressureUnit::kInchOfMercury},
           {"mmHg", PressureUnit::kMillimetreOfMercury},
           {"mH2O", PressureUnit::kMetreOfWater}},
          "Unit of the pressure in lines that do not state it (Paroscientific).")
      .DataSheet();
  section
      ->Add("air_pressure_pa",
            &depth->air_pressure_pa,
            Unit::kNone,
            Range::Within(0.0, 120'000.0),
            "Air pressure at the surface, in pascal, which is subtracted from the measured "
            "pressure. 0 for a sensor of gauge pressure.")
      .DataSheet();
  section
      ->Add(
          "water_density_kgpm3",
          &depth->water_density_kgpm3,
          Unit::kNone,
          Range::Within(900.0, 1200.0),
          "Mean density of the water above the vehicle, in kg/m^3, by which pressure is converted "
          "to depth. About 1000 in fresh water. An error of 1 % is an error of 1 % in depth.")
      .DataSheet();
}

bool InsIsOnCan(const NavDriverConfig& config) {
  return FindEntry(kInsFormats, config.ins_format)->source == SourceKind::kCan;
}

void CheckSourceOf(const std::string& path,
                   const std::string& key,
                   const NavDeviceParams& device,
                   SourceKind kind) {
  if (device.source.empty()) return;
  try {
    ExpectUsable(device.source, kind);
  } catch (const std::runtime_error& e) {
    throw ConfigError(path + ": " + key + ": " + e.what());
  }
}

// dbc: path relative to the configuration file; made absolute.
SignalMap LoadInsSignals(const std::string& path, std::string* dbc) {
  namespace fs = std::filesystem;
  *dbc = (fs::absolute(path).parent_path() / *dbc).lexically_normal().string();
  try {
    return EcanSignals(Dbc::Load(*dbc));
  } catch (const std::runtime_error& e) {
    throw ConfigError(path + ": ins.dbc: " + e.what());
  }
}

void AddPrefixed(const std::string& prefix, const Counters& from, Counters* to) {
  for (const auto& [name, value] : from) (*to)[prefix + "_" + name] += value;
}

}  // namespace

NavDriverConfig::NavDriverConfig() = default;

std::set<std::string> NavDriverConfig::sources() const {
  std::set<std::string> all{ins.source, gps.source, usbl.source, depth.source};
  all.erase("");
  return all;
}

std::set<std::string> NavDriverConfig::output_channels() const {
  std::set<std::string> all;
  if (!ins.source.empty()) all.insert(channels::kIns);
  if (!gps.source.empty() || !usbl.source.empty()) all.insert(channels::kPositionFix);
  if (!depth.source.empty()) all.insert(channels::kDepth);
  return all;
}

ParameterTable TableOf(NavDriverConfig* config) {
  ParameterTable table;
  table.Add("needs_checksum",
            &config->needs_checksum,
            "Whether NMEA sentences without a checksum are dropped. PSIMSSB is always accepted "
            "without one.");
  table.Add("receive_buffer_bytes",
            &config->receive_buffer_bytes,
            Unit::kByte,
            Range::Within(65'536, 256 * 1024 * 1024),
            "Receive buffer of a UDP socket, at most net.core.rmem_max. Increase it when "
            "udp_dropped rises.");

  ParameterTable& ins = DeclareDevice(
      "ins",
      "An INS. Its poses replace dead reckoning where mapper.yaml has navigation_source: given.",
      &config->ins,
      &table);
  ins.AddChoice(
         "format",
         &config->ins_format,
         NamesOf(kInsFormats),
         "Format of its messages: NMEA 0183, iXblue standard binary, Kongsberg KM binary, or ECAN "
         "of SBG Systems.")
      .DataSheet();
  DeclareClock(&config->ins_nmea.clock, true, &ins);
  ins.Add("invert_roll",
          &config->ins_nmea.invert_roll,
          "Set to true if the INS sends roll positive with the port side down. Used with format: "
          "nmea.");
  ins.Add("invert_pitch",
          &config->ins_nmea.invert_pitch,
          "Set to true if the INS sends pitch positive with the bow down. Used with format: nmea.");
  ins.Add("altitude_is_depth",
          &config->altitude_is_depth,
          "Set to true if the INS derives its altitude from a pressure sensor: depth is then minus "
          "altitude. Used with format: phins or sbg_ecan.");
  ins.Add("dbc",
          &config->ins_dbc,
          "DBC file with the CAN ids of its messages, beside this file. Change it if the ids were "
          "changed in the INS. Used with format: sbg_ecan.");

  ParameterTable& gps =
      DeclareDevice("gps",
                    "A GPS (GNSS) receiver, for fixes at the surface. Sentence: GGA.",
                    &config->gps,
                    &table);
  DeclareFixes(&config->gps_fixes,
               "Error of a fix to the north and to the east, 1 sigma each, at an HDOP of 1. It is "
               "multiplied by the received HDOP if that is above 1.",
               &gps);

  ParameterTable& usbl = DeclareDevice("usbl",
                                       "A USBL system that sends the geographic position of this "
                                       "vehicle. Sentences: PSIMSSB or GGA.",
                                       &config->usbl,
                                       &table);
  DeclareFixes(&config->usbl_fixes,
               "Error of a fix to the north and to the east, 1 sigma each. If the "
               "sentence states a larger error, that one is used.",
               &usbl);
  usbl.Add("transponder",
           &config->usbl_fixes.transponder,
           "Transponder of this vehicle, such as B01. Empty: the first that is received.")
      .DataSheet();

  ParameterTable& depth = DeclareDevice(
      "depth",
      "A pressure sensor (DBS, PIPS, PVIPS2, PRVAT; lines of Paroscientific and Valeport).",
      &config->depth,
      &table);
  DeclareDepth(&config->depth_codec, &depth);
  return table;
}

NavDriverConfig LoadNavDriverConfig(const std::string& path) {
  NavDriverConfig config;
  config.file = path;
  LoadParameters(path, TableOf(&config));
  const bool ins_is_on_can = InsIsOnCan(config);
  CheckSourceOf(
      path, "ins.source", config.ins, ins_is_on_can ? SourceKind::kCan : SourceKind::kBytes);
  for (const auto& [name, device] :
       {std::pair("gps", &config.gps), {"usbl", &config.usbl}, {"depth", &config.depth}}) {
    const std::string key = name + std::string(".source");
    CheckSourceOf(path, key, *device, SourceKind::kBytes);
    if (ins_is_on_can && !device->source.empty() && device->source == config.ins.source)
      throw ConfigError(path + ": " + key + ": " + device->source +
                        ": expected another than that of ins, which is CAN");
  }
  if (ins_is_on_can) config.ins_signals = LoadInsSignals(path, &config.ins_dbc);
  return config;
}

std::string PrintConfig(const NavDriverConfig& config) {
  const NavDriverConfig defaults;
  return PrintWithDefaults(config, defaults);
}

std::vector<std::pair<std::string, std::string>> ConfigFiles(const NavDriverConfig& config) {
  if (!InsIsOnCan(config)) return {{"nav_driver.yaml", PrintConfig(config)}};
  const std::filesystem::path dbc = config.ins_dbc;
  NavDriverConfig published = config;
  published.ins_dbc = dbc.filename().string();
  return {{published.ins_dbc, TextOfDbc(dbc)}, {"nav_driver.yaml", PrintConfig(published)}};
}

// --- driver --------------------------------------------------------------------------------------

NavDriver::NavDriver(const NavDriverConfig& config, DriverOutput* output)
    : config_(config), output_(output), health_("nav-driver") {
  AddDevice("ins", config.ins, FindEntry(kInsFormats, config.ins_format)->make(config));
  NmeaFixParams gps = config.gps_fixes, usbl = config.usbl_fixes;
  DepthCodecParams depth = config.depth_codec;
  gps.needs_checksum = usbl.needs_checksum = depth.needs_checksum = config.needs_checksum;
  AddDevice("gps", config.gps, std::make_unique<NmeaFixes>(gps));
  AddDevice("usbl", config.usbl, std::make_unique<NmeaFixes>(usbl));
  AddDevice("depth", config.depth, std::make_unique<DepthCodec>(depth));
  std::string text;
  for (const Device& device : devices_)
    text += (text.empty() ? "" : ", ") + device.name + " at " + device.params.source;
  health_.SetText(text);
  health_.SetStarting("waiting for " + text);
  const bool may_all_be_silent =
      std::all_of(devices_.begin(), devices_.end(), [](const Device& device) {
        return device.params.timeout_s == 0.0;
      });
  if (may_all_be_silent) health_.SetRunning();
}

void NavDriver::AddDevice(const std::string& name,
                          const NavDeviceParams& params,
                          std::unique_ptr<NavCodec> codec) {
  if (params.source.empty()) return;
  devices_.push_back({name, params, std::move(codec), 0, std::nullopt});
}

bool NavDriver::Feed(const std::string& source, const Datagram& piece) {
  health_.Tick("pieces");
  output_->Put({channels::kRawNav, source, piece.recv, piece.bytes});
  bool understood = false;
  for (Device& device : devices_) {
    if (device.params.source != source) continue;
    const std::int64_t heard = device.codec->messages();
    for (NavOutput& measured : device.codec->Add(piece.bytes, piece.recv))
      Put(std::move(measured), piece.recv);
    understood = understood || device.codec->messages() > heard;
  }
  return understood;
}

void NavDriver::Put(NavOutput measured, Time recv) {
  health_.Tick(std::holds_alternative<NavigationSample>(measured) ? "ins"
               : std::holds_alternative<PositionFix>(measured)    ? "position_fixes"
                                                                  : "depth");
  std::visit([&](auto& sample) { output_->Put(std::move(sample), recv); }, measured);
}

std::vector<CanFilter> NavDriver::can_filters(const std::string& source) const {
  for (const Device& device : devices_)
    if (device.params.source == source) return device.codec->can_filters();
  return {};
}

Counters NavDriver::decoder_counters() const {
  Counters all;
  for (const Device& device : devices_) AddPrefixed(device.name, device.codec->counters(), &all);
  return all;
}

void NavDriver::UpdateHealth(const std::map<std::string, SourceState>& sources,
                             Clock::time_point now) {
  SetAll(decoder_counters(), &health_);
  for (const Device& device : devices_) SetAll(device.codec->clock_figures(device.name), &health_);
  CheckSources(sources, now);
  CheckDevices(now);
}

void NavDriver::CheckSources(const std::map<std::string, SourceState>& sources,
                             Clock::time_point now) {
  Counters sums;
  std::string troubles, can_troubles;
  SenderRefusal refusals;
  for (const auto& [url, state] : sources) {
    for (const auto& [name, value] : state.counters) sums[name] += value;
    const auto say = [&url = url](const std::string& what, std::string* text) {
      if (!what.empty()) *text += (text->empty() ? "" : "; ") + url + ": " + what;
    };
    say(state.trouble, &troubles);
    say(state.can_trouble, &can_troubles);
    say(state.refusal.last, &refusals.last);
    refusals.count += state.refusal.count;
  }
  SetAll(sums, &health_);
  health_.HoldIf(!troubles.empty(), conditions::kSourceUnavailable, troubles);
  health_.HoldIf(!can_troubles.empty(), conditions::kCanController, can_troubles);
  FollowRefusals(refusals, now, &health_);
}

void NavDriver::CheckDevices(Clock::time_point now) {
  std::string silent;
  for (Device& device : devices_) {
    const std::int64_t heard = device.codec->messages();
    if (heard > device.heard) health_.SetRunning();
    if (heard > device.heard || !device.last_heard) device.last_heard = now;
    device.heard = heard;
    const double silence_s = std::chrono::duration<double>(now - *device.last_heard).count();
    if (device.params.timeout_s == 0.0 || silence_s < device.params.timeout_s) continue;
    char duration[40];
    std::snprintf(duration, sizeof duration, " for %.0f s", std::floor(silence_s));
    const std::string instead = device.codec->unused_messages();
    silent += (silent.empty() ? "" : "; ") + device.name + " at " + device.params.source + duration;
    if (!instead.empty()) silent += ", where it hears " + instead;
  }
  health_.HoldIf(!silent.empty(), conditions::kNoDeviceData, silent);
  if (!silent.empty()) health_.SetRunning();
}

int Run(NavDriver* driver, Bus* bus, EventLoop* loop) {
  const NavDriverConfig& config = driver->config();
  if (config.sources().empty())
    throw ConfigError(config.file +
                      ": ins.source, gps.source, usbl.source, depth.source: all are empty, and "
                      "there is nothing to read");
  std::map<std::string, std::unique_ptr<ByteSource>> sources;
  for (const std::string& url : config.sources()) {
    const std::vector<CanFilter> filters = driver->can_filters(url);
    sources[url] = filters.empty() ? OpenByteSource(url, config.receive_buffer_bytes)
                                   : OpenCanBytes(url, filters, config.receive_buffer_bytes);
  }
  Datagram piece;
  for (const auto& [url, source] : sources) {
    loop->Add(source->fd(), [driver, loop, &piece, &url = url, source = source.get()] {
      // At most 64 at a time: in a flood, signals and health still get their turn.
      for (int i = 0; i < 64 && source->Receive(&piece); ++i)
        if (driver->Feed(url, piece)) source->Understood(piece);
      if (source->finished()) loop->Stop();
    });
  }
  const auto update_health = [&] {
    std::map<std::string, NavDriver::SourceState> states;
    for (const auto& [url, source] : sources) {
      source->Check();
      states[url] = {
          source->trouble(), source->refusal(), source->counters(), source->can_trouble()};
    }
    driver->UpdateHealth(states, NavDriver::Clock::now());
  };
  update_health();
  loop->Every(std::chrono::seconds(1), update_health);
  driver->health().PublishEverySecond(bus, loop);
  return loop->Run();
}

}  // namespace seastitch
