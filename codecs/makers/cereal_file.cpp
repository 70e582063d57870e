#include "codecs/makers/cereal_file.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kCountBytes = 8;
constexpr std::size_t kMaxText = 256;
constexpr std::size_t kMaxBeams = 65'536;
constexpr std::size_t kPointBytes = 32;  // rows, columns, three numbers

// Bytes before the string, and bytes between the string and the number of beams.
constexpr std::size_t kBeforeText = 4 + 8;
constexpr std::size_t kPoseBytes = 8 + 4 * 8 + 1 + kPointBytes;

std::uint64_t NumberAt(Bytes bytes, std::size_t at) {
  return ByteReader(bytes.subspan(at)).Le<std::uint64_t>();
}

bool IsPoint(Bytes bytes) {
  ByteReader in(bytes);
  const auto rows = in.Le<std::int32_t>();
  return rows == 3 && in.Le<std::int32_t>() == 1;
}

Eigen::Vector3d ReadPoint(ByteReader* in) {
  in->Skip(8);
  const double x = in->Le<double>();
  const double y = in->Le<double>();
  return {x, y, in->Le<double>()};
}

// Stamps are milliseconds in files of AUVLIB's parsers, seconds in files of its naviedit script.
Time TimeOf(std::int64_t stamp) {
  constexpr std::int64_t kMilliseconds = 100'000'000'000;
  return stamp > kMilliseconds ? Time(std::chrono::milliseconds(stamp))
                               : Time(std::chrono::seconds(stamp));
}

bool IsWholeSecond(Time t) {
  return t.time_since_epoch() % std::chrono::seconds(1) == Duration::zero();
}

bool IsStamp(std::int64_t stamp) { return stamp > 0 && stamp < 100'000'000'000'000; }

// More than any sonar sends in a second.
constexpr std::size_t kMaxPerSecond = 1000;

}  // namespace

SurveyReader::Look CerealFileReader::LookAt(Bytes bytes, bool /*at_end*/) const {
  if (at_start_) {
    // The portable archive has one more byte in front. Only one of the two layouts gives a
    // plausible length of the first string.
    if (bytes.size() < kCountBytes + 1 + kBeforeText) return TooShort();
    const bool portable =
        bytes[0] == 1 && NumberAt(bytes, kCountBytes + 5) <= kMaxText &&
        (NumberAt(bytes, kCountBytes + 4) == 0 || NumberAt(bytes, kCountBytes + 4) > kMaxText);
    return Record(kCountBytes + (portable ? 1 : 0));
  }
  if (bytes.size() < kBeforeText) return TooShort();
  const std::uint64_t text_bytes = NumberAt(bytes, 4);
  if (text_bytes > kMaxText) return Damage();
  const std::size_t beams_at = kBeforeText + text_bytes + kPoseBytes;
  if (bytes.size() < beams_at + 8) return TooShort();
  if (!IsPoint(bytes.subspan(beams_at - kPointBytes))) return Damage();
  const std::uint64_t num_beams = NumberAt(bytes, beams_at);
  if (num_beams > kMaxBeams) return Damage();
  const std::size_t strengths_at = beams_at + 8 + num_beams * kPointBytes;
  if (bytes.size() < strengths_at + 8) return TooShort();
  for (std::size_t i = 0; i < num_beams; ++i)
    if (!IsPoint(bytes.subspan(beams_at + 8 + i * kPointBytes))) return Damage();
  const std::uint64_t num_strengths = NumberAt(bytes, strengths_at);
  if (num_strengths != 0 && num_strengths != num_beams) return Damage();
  return Record(strengths_at + 8 + num_strengths * 8);
}

void CerealFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  ByteReader in(record);
  if (std::exchange(at_start_, false)) {
    in.Skip(record.size() - kCountBytes);
    missing_ = in.Le<std::uint64_t>();
    return;
  }
  if (missing_ > 0) --missing_;
  PlacedPing ping;
  ping.ping_number = in.Le<std::uint32_t>();
  in.Skip(in.Le<std::uint64_t>());
  const auto stamp = in.Le<std::int64_t>();
  const double yaw_rad = in.Le<double>();  // counter-clockwise from east
  in.Skip(8);                              // heave, which AUVLIB may leave unset
  const double pitch_rad = in.Le<double>();
  const double roll_rad = in.Le<double>();
  in.Skip(1);
  const Eigen::Vector3d place = ReadPoint(&in);  // east, north, up
  if (!IsStamp(stamp) || !std::isfinite(yaw_rad) || !place.allFinite())
    return Count("cereal_malformed");

  if (!same_stamp_.empty() && same_stamp_.front().pose.time != TimeOf(stamp)) Spread(out);
  if (same_stamp_.size() >= kMaxPerSecond) return Count("cereal_stamp_stands_still");
  NavigationRecord pose;
  pose.source = "auvlib";
  pose.time = ping.time = TimeOf(stamp);
  pose.grid_north_east_m = Eigen::Vector2d(place.y(), place.x());
  pose.depth_m = ping.origin_depth_m = -place.z();
  const double heading_rad = WrapAngle(kPi / 2.0 - yaw_rad);
  if (std::isfinite(roll_rad) && std::isfinite(pitch_rad))
    pose.attitude = AttitudeFromRadians(roll_rad, pitch_rad, heading_rad);
  else
    pose.heading_rad = heading_rad;

  const std::uint64_t num_beams = in.Le<std::uint64_t>();
  const double c = std::cos(yaw_rad);
  const double s = std::sin(yaw_rad);
  for (std::uint64_t i = 0; i < num_beams; ++i) {
    const Eigen::Vector3d d = ReadPoint(&in) - place;
    PlacedBeam beam;
    beam.p_level_m =
        Eigen::Vector3d(c * d.x() + s * d.y(), s * d.x() - c * d.y(), -d.z()).cast<float>();
    beam.flags = kBeamValid;
    ping.soundings.push_back(beam.p_level_m.allFinite() ? beam : PlacedBeam{});
  }
  same_stamp_.push_back({std::move(pose), std::move(ping)});
  if (!IsWholeSecond(TimeOf(stamp))) Spread(out);
}

void CerealFileReader::End(std::vector<SurveyRecord>* out) { Spread(out); }

void CerealFileReader::Spread(std::vector<SurveyRecord>* out) {
  if (same_stamp_.empty()) return;
  constexpr Duration kSecond = std::chrono::seconds(1);
  const auto pings = static_cast<std::int64_t>(same_stamp_.size());
  for (std::int64_t i = 0; i < pings; ++i) {
    Ping& ping = same_stamp_[static_cast<std::size_t>(i)];
    ping.pose.time = ping.soundings.time = ping.pose.time + i * kSecond / pings;
    out->emplace_back(std::move(ping.pose));
    out->emplace_back(std::move(ping.soundings));
  }
  same_stamp_.clear();
}

}  // namespace seastitch
