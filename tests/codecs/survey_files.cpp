#include "tests/codecs/survey_files.hpp"

#include <sstream>

namespace seastitch {
namespace {

struct Print {
  std::ostringstream& out;

  void operator()(const MbesPing& p) const {
    out << "ping " << ToUtime(p.time) << ' ' << p.ping_number << ' ' << int{p.head} << ' '
        << p.sound_speed_mps;
    for (const MbesBeam& b : p.beams)
      out << ' ' << b.twtt_s << ' ' << b.rx_angle_rad << ' ' << b.tx_tilt_rad << ' ' << b.tx_delay_s
          << ' ' << int{b.flags} << ' ' << int{b.tx_array};
  }
  void operator()(const PlacedPing& p) const {
    out << "soundings " << ToUtime(p.time) << ' ' << p.ping_number << ' ' << int{p.head} << ' '
        << p.origin_depth_m.value_or(-1.0) << ' ' << p.p_vehicle_origin_m.transpose();
    for (const PlacedBeam& b : p.soundings)
      out << ' ' << b.p_level_m.transpose() << ' ' << int{b.flags};
  }
  void operator()(const NavigationRecord& n) const {
    out << "navigation " << ToUtime(n.time) << ' ' << n.source << ' ' << n.status;
    if (n.position) out << " at " << n.position->latitude_rad << ' ' << n.position->longitude_rad;
    for (const auto& value : {n.depth_m, n.height_m, n.heave_m}) out << ' ' << value.value_or(-1.0);
    if (n.attitude) out << " q " << n.attitude->q_ned_imu.coeffs().transpose();
    if (n.grid_north_east_m) out << " grid " << n.grid_north_east_m->transpose();
    if (n.roll_pitch_rad) out << " roll, pitch " << n.roll_pitch_rad->transpose();
    if (n.heading_rad) out << " heading " << *n.heading_rad;
    if (n.velocity) out << " v " << n.velocity->v_ned_mps.transpose();
  }
  void operator()(const SoundVelocityProfile& p) const {
    out << "profile " << ToUtime(p.time);
    for (std::size_t i = 0; i < p.depth_m.size(); ++i)
      out << ' ' << p.depth_m[i] << ' ' << p.speed_mps[i];
  }
  void operator()(const SurfaceSoundSpeed& s) const {
    out << "sound speed " << ToUtime(s.time) << ' ' << s.speed_mps;
  }
  void operator()(const SonarInstallation& i) const {
    out << "installation " << ToUtime(i.time) << ' ' << i.model << ' ' << i.transmitters.size()
        << ' ' << i.receivers.size() << ' ' << i.sensors.size();
    for (const auto& [name, value] : i.values) out << ' ' << name << '=' << value;
  }
  void operator()(const ClockComparison& c) const {
    out << "clock " << ToUtime(c.time) << ' ' << c.source << ' ' << ToUtime(c.external_time);
  }
  void operator()(const SonarSettings& s) const {
    out << "settings " << ToUtime(s.time);
    for (const auto& [name, value] : s.values) out << ' ' << name << '=' << value;
  }
};

struct Check {
  std::string operator()(const MbesPing& p) const {
    if (!std::isfinite(p.sound_speed_mps) || p.sound_speed_mps < 0.0) return "sound speed";
    if (p.beams.size() > 2048) return "number of beams";
    return std::all_of(p.beams.begin(), p.beams.end(), IsPlausible) ? "" : "beam";
  }
  std::string operator()(const PlacedPing& p) const {
    if (!p.p_vehicle_origin_m.allFinite()) return "origin";
    if (!std::isfinite(p.origin_depth_m.value_or(0.0))) return "depth of origin";
    for (const PlacedBeam& b : p.soundings)
      if (!b.p_level_m.allFinite() || !std::isfinite(b.sigma_z_m)) return "sounding";
    return "";
  }
  std::string operator()(const NavigationRecord& n) const {
    if (n.position &&
        !(std::abs(n.position->latitude_rad) <= 1.6 && std::abs(n.position->longitude_rad) <= 6.3 &&
          n.position->sigma_north_east_m.allFinite()))
      return "position";
    for (const auto& value : {n.depth_m, n.height_m, n.heave_m})
      if (!std::isfinite(value.value_or(0.0))) return "height";
    if (n.attitude && !(std::abs(n.attitude->q_ned_imu.norm() - 1.0) < 1e-6 &&
                        n.attitude->sigma_rpy_rad.allFinite()))
      return "attitude";
    if (n.grid_north_east_m && !n.grid_north_east_m->allFinite()) return "place in the grid";
    if (n.roll_pitch_rad && !n.roll_pitch_rad->allFinite()) return "roll and pitch";
    if (!std::isfinite(n.heading_rad.value_or(0.0))) return "heading";
    if (n.velocity && !n.velocity->v_ned_mps.allFinite()) return "velocity";
    return "";
  }
  std::string operator()(const SoundVelocityProfile& p) const {
    if (p.depth_m.empty() || p.depth_m.size() != p.speed_mps.size()) return "profile's size";
    for (std::size_t i = 0; i < p.depth_m.size(); ++i)
      if (!std::isfinite(p.depth_m[i]) || !(p.speed_mps[i] > 0.0) ||
          (i > 0 && !(p.depth_m[i] > p.depth_m[i - 1])))
        return "profile";
    return "";
  }
  std::string operator()(const SurfaceSoundSpeed& s) const {
    return std::isfinite(s.speed_mps) && s.speed_mps > 0.0 ? "" : "sound speed";
  }
  std::string operator()(const SonarInstallation& i) const {
    for (const auto* arrays : {&i.transmitters, &i.receivers})
      for (const InstalledArray& array : *arrays)
        if (!array.At(0).matrix().allFinite()) return "array";
    return std::isfinite(i.water_line_m) ? "" : "water line";
  }
  std::string operator()(const ClockComparison&) const { return ""; }
  std::string operator()(const SonarSettings&) const { return ""; }
};

}  // namespace

SurveyContents ReadSurvey(Bytes file, SurveyReader* reader, std::size_t piece_bytes) {
  SurveyContents contents;
  const auto keep = [&contents](std::vector<SurveyRecord> records) {
    std::move(records.begin(), records.end(), std::back_inserter(contents.records));
  };
  for (std::size_t at = 0; at < file.size(); at += piece_bytes)
    keep(reader->Add(file.subspan(at, std::min(piece_bytes, file.size() - at))));
  keep(reader->Finish());
  contents.counters = reader->counters();
  return contents;
}

std::string TextOf(const SurveyContents& contents) {
  std::ostringstream out;
  out.precision(17);
  for (const SurveyRecord& record : contents.records) {
    std::visit(Print{out}, record);
    out << '\n';
  }
  for (const auto& [name, value] : contents.counters) out << name << ' ' << value << '\n';
  return out.str();
}

std::string ProblemWith(const SurveyRecord& record) { return std::visit(Check{}, record); }

}  // namespace seastitch
