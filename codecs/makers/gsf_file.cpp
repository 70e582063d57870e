#include "codecs/makers/gsf_file.hpp"

#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "codecs/sound_profile.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kFrameBytes = 8;
constexpr std::uint32_t kHasChecksum = 1u << 31;
constexpr std::uint32_t kLastType = 12;
constexpr std::uint8_t kScaleFactors = 100;

enum Type : std::uint32_t {
  kHeader = 1,
  kPing = 2,
  kProfile = 3,
  kProcessing = 4,
  kAttitude = 12,
};

enum Array : std::uint8_t {
  kDepth = 1,
  kAcross = 2,
  kAlong = 3,
  kBeamFlags = 16,
  kVerticalError = 19,
};
bool IsSigned(std::uint8_t array) { return array == kAcross || array == kAlong; }

constexpr double kNoAngle_deg = 99.0;
constexpr double kNoHeave_m = 99.0;
constexpr double kNoHeading_deg = 360.0;  // larger values mean "unknown": 655.35
constexpr double kPercent95 = 1.96;       // 95 % of a normal distribution, in sigmas

struct Frame {
  std::size_t data_bytes = 0;
  std::uint32_t type = 0;
  bool has_checksum = false;

  std::size_t data_at() const { return kFrameBytes + (has_checksum ? 4 : 0); }
};

Frame ReadFrame(ByteReader* in) {
  Frame frame;
  frame.data_bytes = in->Be<std::uint32_t>();
  const auto word = in->Be<std::uint32_t>();
  frame.has_checksum = (word & kHasChecksum) != 0;
  frame.type = word & ~kHasChecksum;
  return frame;
}

Time ReadTime(ByteReader* in) {
  const std::int64_t seconds = in->Be<std::uint32_t>();
  const std::int64_t nanoseconds = in->Be<std::uint32_t>();
  return FromUtime(seconds * 1'000'000 + (nanoseconds + 500) / 1000);
}

struct Motion {
  double pitch_deg = 0.0;
  double roll_deg = 0.0;
  double heave_m = 0.0;
  double heading_deg = 0.0;
};

void Fill(const Motion& motion, NavigationRecord* sample) {
  const bool heading = motion.heading_deg <= kNoHeading_deg;
  const bool angles =
      std::abs(motion.roll_deg) < kNoAngle_deg && std::abs(motion.pitch_deg) < kNoAngle_deg;
  if (angles && heading)
    sample->attitude = AttitudeFromDegrees(motion.roll_deg, motion.pitch_deg, motion.heading_deg);
  else if (heading)
    sample->heading_rad = Deg2Rad(motion.heading_deg);
  if (std::abs(motion.heave_m) < kNoHeave_m) sample->heave_m = motion.heave_m;
}

std::optional<std::vector<NavigationRecord>> ReadAttitude(Bytes data) {
  ByteReader in(data);
  const Time start = ReadTime(&in);
  const std::size_t count = in.Be<std::uint16_t>();
  if (!in.ok() || in.left() < 10 * count) return std::nullopt;
  std::vector<NavigationRecord> samples;
  for (std::size_t i = 0; i < count; ++i) {
    NavigationRecord sample;
    sample.source = "gsf_attitude";
    sample.time = start + std::chrono::milliseconds(in.Be<std::uint16_t>());
    Motion motion;
    motion.pitch_deg = in.Be<std::int16_t>() / 100.0;
    motion.roll_deg = in.Be<std::int16_t>() / 100.0;
    motion.heave_m = in.Be<std::int16_t>() / 100.0;
    motion.heading_deg = in.Be<std::uint16_t>() / 100.0;
    Fill(motion, &sample);
    samples.push_back(std::move(sample));
  }
  return samples;
}

std::optional<SoundVelocityProfile> ReadProfile(Bytes data) {
  ByteReader in(data);
  const Time time = ReadTime(&in);
  in.Skip(16);  // time of application, place of the cast
  const std::size_t count = in.Be<std::uint32_t>();
  if (!in.ok() || in.left() / 8 < count) return std::nullopt;
  std::vector<ProfileRow> rows(count);
  for (ProfileRow& row : rows) {
    row.depth_m = in.Be<std::uint32_t>() / 100.0;
    row.speed_mps = in.Be<std::uint32_t>() / 100.0;
  }
  return ProfileFrom(time, std::move(rows));
}

std::optional<SonarSettings> ReadProcessing(Bytes data) {
  ByteReader in(data);
  SonarSettings out{ReadTime(&in), {}};
  const std::size_t count = in.Be<std::uint16_t>();
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    const std::string text = TextFromBytes(in.Take(in.Be<std::uint16_t>()));
    const std::size_t equals = text.find('=');
    if (equals != std::string::npos)
      out.values.emplace(text.substr(0, equals), text.substr(equals + 1));
  }
  return in.ok() ? std::optional(std::move(out)) : std::nullopt;
}

template <class Signed, class Unsigned>
double ReadAs(ByteReader* in, bool is_signed) {
  return is_signed ? static_cast<double>(in->Be<Signed>())
                   : static_cast<double>(in->Be<Unsigned>());
}

double ReadRaw(ByteReader* in, std::size_t bytes_each, bool is_signed) {
  if (bytes_each == 1) return ReadAs<std::int8_t, std::uint8_t>(in, is_signed);
  if (bytes_each == 2) return ReadAs<std::int16_t, std::uint16_t>(in, is_signed);
  return ReadAs<std::int32_t, std::uint32_t>(in, is_signed);
}

}  // namespace

// The arrays of one ping, in metres; flags as in the file.
struct GsfFileReader::Arrays {
  std::size_t num_beams = 0;
  std::map<std::uint8_t, std::vector<double>> of;

  const std::vector<double>* Find(std::uint8_t array) const {
    const auto found = of.find(array);
    return found == of.end() ? nullptr : &found->second;
  }
};

SurveyReader::Look GsfFileReader::LookAt(Bytes bytes, bool /*at_end*/) const {
  if (bytes.size() < kFrameBytes) return TooShort();
  ByteReader in(bytes);
  const Frame frame = ReadFrame(&in);
  const bool usable = frame.type >= 1 && frame.type <= kLastType && frame.data_bytes > 0 &&
                      frame.data_bytes % 4 == 0 && frame.data_bytes <= kMaxRecordBytes - 12;
  return usable ? Record(frame.data_at() + frame.data_bytes) : Damage();
}

void GsfFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  ByteReader in(record);
  const Frame frame = ReadFrame(&in);
  const Bytes data = record.subspan(frame.data_at());
  const bool intact =
      !frame.has_checksum ||
      in.Be<std::uint32_t>() == std::accumulate(data.begin(), data.end(), std::uint32_t{0});
  if (!intact || !ReadRecord(frame.type, data, out)) Count("gsf_malformed");
}

bool GsfFileReader::ReadRecord(std::uint32_t type, Bytes data, std::vector<SurveyRecord>* out) {
  if (type == kHeader) {
    const std::string text = TextFromBytes(data);
    version_ = 0;
    for (const int version : {1, 2, 3})
      if (text.starts_with("GSF-v0" + std::to_string(version))) version_ = version;
    return true;
  }
  if (version_ == 0) {
    Count("gsf_version_unknown");
    return true;
  }
  switch (type) {
    case kPing: return ReadPing(data, out);
    case kProfile: return AppendRecords(ReadProfile(data), out);
    case kProcessing: return AppendRecords(ReadProcessing(data), out);
    case kAttitude: return AppendRecords(ReadAttitude(data), out);
    default: CountIgnored("gsf", std::to_string(type)); return true;
  }
}

bool GsfFileReader::ReadPing(Bytes data, std::vector<SurveyRecord>* out) {
  constexpr std::uint16_t kIgnorePing = 1;
  ByteReader in(data);
  NavigationRecord navigation;
  navigation.source = "gsf_ping";
  navigation.time = ReadTime(&in);
  const double longitude_deg = in.Be<std::int32_t>() / 1e7;
  const double latitude_deg = in.Be<std::int32_t>() / 1e7;
  Arrays arrays;
  arrays.num_beams = in.Be<std::uint16_t>();
  in.Skip(2);
  const auto flags = in.Be<std::uint16_t>();
  in.Skip(2 + 2 + 4);  // reserved, tide, draft
  Motion motion;
  motion.heading_deg = in.Be<std::uint16_t>() / 100.0;
  motion.pitch_deg = in.Be<std::int16_t>() / 100.0;
  motion.roll_deg = in.Be<std::int16_t>() / 100.0;
  motion.heave_m = in.Be<std::int16_t>() / 100.0;
  in.Skip(4);  // course, speed
  double height_m = 0.0;
  if (version_ >= 3) {
    height_m = in.Be<std::int32_t>() / 1000.0;
    in.Skip(4 + 4 + 2);
  }
  if (!in.ok() || !ReadSubrecords(&in, &arrays)) return false;

  Fill(motion, &navigation);
  if (std::abs(latitude_deg) <= 90.0 && std::abs(longitude_deg) <= 180.0)
    navigation.position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
  constexpr double kNoHeight_m = 9999.0;
  if (height_m != 0.0 && std::abs(height_m) < kNoHeight_m) navigation.height_m = height_m;

  PlacedPing ping;
  ping.time = navigation.time;
  ping.ping_number = pings_++;
  ping.origin_depth_m = 0.0;
  const auto* const depth = arrays.Find(kDepth);
  const auto* const across = arrays.Find(kAcross);
  const auto* const along = arrays.Find(kAlong);
  const auto* const beam_flags = arrays.Find(kBeamFlags);
  const auto* const error = arrays.Find(kVerticalError);
  if (depth == nullptr || across == nullptr) {
    Count("gsf_ping_without_depths");
    out->emplace_back(std::move(navigation));
    return true;
  }
  for (std::size_t i = 0; i < arrays.num_beams; ++i) {
    PlacedBeam beam;
    beam.p_level_m =
        Eigen::Vector3d(along ? (*along)[i] : 0.0, (*across)[i], (*depth)[i]).cast<float>();
    if (error) beam.sigma_z_m = static_cast<float>((*error)[i] / kPercent95);
    const bool ignored = (*depth)[i] == 0.0 || (flags & kIgnorePing) != 0 ||
                         (beam_flags && static_cast<int>((*beam_flags)[i]) % 2 != 0);
    beam.flags = ignored ? 0 : kBeamValid;
    ping.soundings.push_back(beam);
  }
  out->emplace_back(std::move(navigation));
  out->emplace_back(std::move(ping));
  return true;
}

// False if a size or scale is impossible, or if arrays are compressed.
bool GsfFileReader::ReadSubrecords(ByteReader* in, Arrays* arrays) {
  while (in->left() > 4) {
    const auto word = in->Be<std::uint32_t>();
    const auto id = static_cast<std::uint8_t>(word >> 24);
    const Bytes subrecord = in->Take(word & 0xFFFFFF);
    if (!in->ok()) return false;
    if (id == kScaleFactors) {
      if (!ReadScales(subrecord)) return false;
      continue;
    }
    if (id != kDepth && id != kAcross && id != kAlong && id != kBeamFlags && id != kVerticalError)
      continue;
    const Scale scale = id == kBeamFlags ? Scale{1.0, 0.0, false} : scales_[id];
    if (scale.compressed) {
      Count("gsf_compressed");
      return false;
    }
    if (arrays->num_beams == 0 || scale.multiplier == 0.0) return false;
    const std::size_t bytes_each = subrecord.size() / arrays->num_beams;
    if (bytes_each * arrays->num_beams != subrecord.size() ||
        (bytes_each != 1 && bytes_each != 2 && bytes_each != 4))
      return false;
    std::vector<double>& values = arrays->of[id];
    values.clear();
    ByteReader raw(subrecord);
    for (std::size_t i = 0; i < arrays->num_beams; ++i)
      values.push_back(ReadRaw(&raw, bytes_each, IsSigned(id)) / scale.multiplier - scale.offset);
  }
  return true;
}

bool GsfFileReader::ReadScales(Bytes subrecord) {
  ByteReader in(subrecord);
  const std::size_t count = in.Be<std::uint32_t>();
  if (!in.ok() || in.left() / 12 < count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const auto word = in.Be<std::uint32_t>();
    const std::size_t id = word >> 24;
    Scale scale;
    scale.compressed = (word >> 16 & 0x0F) != 0;
    scale.multiplier = in.Be<std::uint32_t>();
    scale.offset = in.Be<std::int32_t>();
    if (id == 0 || id >= scales_.size() || scale.multiplier == 0.0) return false;
    scales_[id] = scale;
  }
  return true;
}

}  // namespace seastitch
