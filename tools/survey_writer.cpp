#include "tools/survey_writer.hpp"

#include <deque>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <variant>
#include <vector>

#include "codecs/kongsberg/em_all_writer.hpp"
#include "codecs/kongsberg/kmall.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "common/convert/message_inbox.hpp"
#include "common/core/pose.hpp"
#include "common/geo/map_frame.hpp"
#include "common/storage/event_log.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/dead_reckoning.hpp"

namespace seastitch {
namespace {

using FileBytes = std::vector<std::uint8_t>;

// Writers of one file format.
struct Format {
  const char* extension;
  FileBytes (*installation)(const SonarInstallation& installation);
  FileBytes (*profile)(const SoundVelocityProfile& profile);
  FileBytes (*ping)(const MbesPing& ping);
  FileBytes (*motion)(const std::vector<NavigationRecord>& samples);
  FileBytes (*position)(const NavigationRecord& sample);
  // Heave is that of the transmitter; else of the reference point.
  bool heave_of_transmitter = false;
};

FileBytes S7kPing(const MbesPing& ping) {
  S7kPingId id;
  id.ping_number = ping.ping_number;
  FileBytes bytes = EncodeS7k7000(id, ping.time, ping.sound_speed_mps);
  const FileBytes detections = EncodeS7k7027(id, ping);
  bytes.insert(bytes.end(), detections.begin(), detections.end());
  return bytes;
}

// 1015 is the only record with a velocity.
FileBytes S7kPosition(const NavigationRecord& sample) {
  FileBytes bytes = EncodeS7k1003(sample);
  if (!sample.velocity) return bytes;
  const FileBytes navigation = EncodeS7k1015(sample);
  bytes.insert(bytes.end(), navigation.begin(), navigation.end());
  return bytes;
}

constexpr Format kFormats[] = {
    {".kmall",
     [](const SonarInstallation& i) { return EncodeIip(i, KmallHeader{}); },
     [](const SoundVelocityProfile& p) { return EncodeSvp(p, KmallHeader{}); },
     [](const MbesPing& p) { return EncodeMrz(p, KmallHeader{}); },
     [](const std::vector<NavigationRecord>& m) { return EncodeSkm(m, KmallHeader{}); },
     [](const NavigationRecord& p) { return EncodeSpo(p, KmallHeader{}); }},
    {".all", EncodeEmI, EncodeEmU, EncodeEmN, EncodeEmA, EncodeEmP, true},
    {".s7k", EncodeS7k7030, EncodeS7k1009, S7kPing, EncodeS7k1016, S7kPosition},
};

const Format* FormatOf(const std::filesystem::path& file) {
  for (const Format& format : kFormats)
    if (file.extension() == format.extension) return &format;
  return nullptr;
}

const Format& ExpectFormat(const std::filesystem::path& file) {
  const Format* const format = FormatOf(file);
  if (format == nullptr)
    throw std::runtime_error(file.string() + ": its name must end with .kmall, .all or .s7k");
  return *format;
}

class Writer {
 public:
  explicit Writer(const SurveyWriterOptions& options)
      : options_(options),
        format_(ExpectFormat(options.file)),
        config_(options.ins),
        map_frame_(DatumOf(config_.vehicle)),
        ins_(config_.navigation, config_.vehicle),
        out_(options.file, std::ios::binary) {
    if (!out_) throw std::runtime_error(options.file.string() + ": cannot be written");
  }

  SurveyWriterResult Run() {
    EventLogReader reader(options_.log);
    MessageInbox inbox;
    while (const std::optional<LogEvent> event = reader.Next())
      if (const auto received = inbox.Take(event->channel, event->data, 0.0)) Use(received->sample);
    ins_.Finish();
    Reckon();
    WriteMotion();
    if (!out_.flush())
      throw std::runtime_error(options_.file.string() + ": cannot be written: disk full?");
    return result_;
  }

 private:
  void Use(const Sample& sample) {
    std::visit(Overloaded{[this](const ImuSample& s) { Navigate(s); },
                          [this](const DvlSample& s) { Navigate(s); },
                          [this](const DepthSample& s) { Navigate(s); },
                          [this](const PositionFix& fix) {
                            if (ins_.start_state() != StartState::kStarted)
                              ins_.Add(fix);  // may start it
                            fixes_.push_back(fix);
                          },
                          [this](const MbesPing& ping) {
                            WriteInstallation(ping.time);
                            Write(format_.ping(ping));
                            ++result_.pings;
                          },
                          [this](const SoundVelocityProfile& profile) {
                            WriteInstallation(profile.time);
                            Write(format_.profile(profile));
                          },
                          [](const auto&) {}},
               sample);
  }

  template <class T>
  void Navigate(const T& sample) {
    ins_.Add(sample);
    Reckon();
  }

  // Advances the INS's navigation to the present, at its own rates.
  void Reckon() {
    const std::optional<Time> latest = ins_.latest();
    if (!latest) return;
    if (!next_motion_) next_motion_ = next_position_ = *latest;
    const auto every = [](double rate_hz) { return FromSeconds(1.0 / rate_hz); };
    for (; *next_motion_ <= *latest; *next_motion_ += every(options_.motion_rate_hz))
      AddMotion(*next_motion_);
    for (; *next_position_ <= *latest; *next_position_ += every(options_.position_rate_hz))
      AddPosition(*next_position_);
  }

  void AddMotion(Time t) {
    const auto state = ins_.StateAt(t);
    if (!state) return;
    NavigationRecord record;
    record.time = t;
    record.attitude = Attitude{Eigen::Quaterniond(state->T_map_vehicle.linear())};
    record.velocity = GeoVelocity{state->v_map_mps};
    record.position = PositionOf(*state);
    record.heave_m = HeaveOf(*state);
    motion_.push_back(record);
    ++result_.motions;
    if (motion_.size() >= 50) WriteMotion();
  }

  // Depth less the depth at rest, with the water line at the reference point.
  double HeaveOf(const NavState& state) const {
    const VehicleGeometry& vehicle = config_.vehicle;
    Eigen::Vector3d p_vehicle_m = Eigen::Vector3d::Zero();
    if (format_.heave_of_transmitter)
      p_vehicle_m = (vehicle.T_vehicle_mbes * vehicle.T_mbes_tx).translation();
    return (state.T_map_vehicle * p_vehicle_m).z() - p_vehicle_m.z();
  }

  void AddPosition(Time t) {
    const auto state = ins_.StateAt(t);
    if (!state) return;
    for (; !fixes_.empty() && fixes_.front().time <= t; fixes_.pop_front()) Take(fixes_.front());
    NavigationRecord record;
    record.time = t;
    record.position = PositionOf(*state);
    // height for a water line on the ellipsoid
    record.height_m = -state->T_map_vehicle.translation().z();
    // That of the INS's navigation: its corrections of position are not motion.
    if (options_.velocity_with_position) record.velocity = GeoVelocity{state->v_map_mps};
    record.heading_rad = RpyFromRotation(state->T_map_vehicle.linear()).z();
    Write(format_.position(record));
    ++result_.positions;
  }

  // The INS accepts the fix: its position jumps.
  void Take(const PositionFix& fix) {
    const auto then = ins_.StateAt(fix.time);
    if (!then) return;
    offset_m_ = map_frame_.NorthEastOf(fix) - then->T_map_vehicle.translation().head<2>();
    ++result_.fixes;
  }

  GeoPosition PositionOf(const NavState& state) const {
    const Datum point = map_frame_.PointAt(state.T_map_vehicle.translation().head<2>() + offset_m_);
    return {Deg2Rad(point.latitude_deg), Deg2Rad(point.longitude_deg)};
  }

  void WriteMotion() {
    if (!motion_.empty()) Write(format_.motion(motion_));
    motion_.clear();
  }

  void WriteInstallation(Time t) {
    if (installed_) return;
    installed_ = true;
    const VehicleGeometry& vehicle = config_.vehicle;
    SonarInstallation installation;
    installation.time = t;
    installation.transmitters.push_back({vehicle.T_vehicle_mbes * vehicle.T_mbes_tx});
    installation.receivers.push_back({vehicle.T_vehicle_mbes * vehicle.T_mbes_rx});
    Write(format_.installation(installation));
  }

  void Write(const std::vector<std::uint8_t>& datagram) {
    out_.write(reinterpret_cast<const char*>(datagram.data()),
               static_cast<std::streamsize>(datagram.size()));
  }

  const SurveyWriterOptions options_;
  const Format& format_;
  const MapperConfig config_;
  const MapFrame map_frame_;
  DeadReckoning ins_;
  std::ofstream out_;
  SurveyWriterResult result_;
  std::optional<Time> next_motion_, next_position_;
  std::deque<PositionFix> fixes_;
  std::vector<NavigationRecord> motion_;
  Eigen::Vector2d offset_m_ = Eigen::Vector2d::Zero();
  bool installed_ = false;
};

}  // namespace

SurveyWriterResult WriteSurveyFile(const SurveyWriterOptions& options) {
  return Writer(options).Run();
}

bool CanWriteSurveyFile(const std::filesystem::path& file) { return FormatOf(file) != nullptr; }

}  // namespace seastitch
