#include "codecs/makers/xtf_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/makers/r2sonic.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::uint8_t kFileHeader = 123;
constexpr std::size_t kFileHeaderBytes = 1024;
constexpr std::size_t kChannelsInHeader = 6;
constexpr std::size_t kChannelBytes = 128;
constexpr std::uint16_t kMagic = 0xFACE;
constexpr std::size_t kPacketHeaderBytes = 14;
constexpr std::size_t kBathymetryHeaderBytes = 256;

enum Type : std::uint8_t { kAttitude = 3, kQinsyR2Sonic = 65, kR2Sonic = 68, kPosition = 107 };

// Names of types that are not read, by number; other types are named by their number.
const std::map<int, std::string> kTypeNames{{0, "sonar"},
                                            {1, "notes"},
                                            {2, "bathymetry"},
                                            {5, "elac"},
                                            {6, "raw_serial"},
                                            {8, "hidden_sonar"},
                                            {14, "klein_3000"},
                                            {16, "elac_xse"},
                                            {17, "bathymetry_xyz"},
                                            {22, "single_beam"},
                                            {23, "gyro"},
                                            {25, "multibeam"},
                                            {26, "qinsy_single_beam"},
                                            {28, "qinsy_multibeam"},
                                            {60, "benthos_sara"},
                                            {61, "reson_7125"},
                                            {62, "reson_7125_snippet"},
                                            {66, "qinsy_r2sonic_snippet"},
                                            {68, "r2sonic"},
                                            {69, "r2sonic_snippet"}};

// Size of the file header. It has room for six channels, sonar and bathymetry together; with more
// it grows by its own size.
std::size_t SizeOfFileHeader(Bytes header) {
  ByteReader in(header);
  in.Skip(166);
  const std::size_t sonar = in.Le<std::uint16_t>();
  const std::size_t channels = sonar + in.Le<std::uint16_t>();
  if (channels <= kChannelsInHeader) return kFileHeaderBytes;
  const std::size_t more = (channels - kChannelsInHeader) * kChannelBytes;
  return kFileHeaderBytes + (more + kFileHeaderBytes - 1) / kFileHeaderBytes * kFileHeaderBytes;
}

// Year (u16), month, day, hour, minute, second.
std::optional<Time> ReadTime(ByteReader* in) {
  const int year = in->Le<std::uint16_t>();
  const int month = in->Le<std::uint8_t>();
  const int day = in->Le<std::uint8_t>();
  const auto midnight = Midnight(year, month, day);
  const int hour = in->Le<std::uint8_t>();
  const int minute = in->Le<std::uint8_t>();
  const int second = in->Le<std::uint8_t>();
  if (!midnight || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  return *midnight + std::chrono::hours(hour) + std::chrono::minutes(minute) +
         std::chrono::seconds(second);
}

// The sonar's own datagram, after the bathymetry header.
Bytes ContentOf(Bytes packet) {
  return packet.subspan(std::min(packet.size(), kBathymetryHeaderBytes));
}

// Type 68 is Triton's own packet of an R2Sonic, of which no file is known here: it is read where
// its content begins as that of QINSy's does.
bool HoldsBth0(Bytes packet) {
  constexpr std::array<std::uint8_t, 4> kBegin{'B', 'T', 'H', '0'};
  const Bytes content = ContentOf(packet);
  return packet[2] == kQinsyR2Sonic || (packet[2] == kR2Sonic && content.size() >= kBegin.size() &&
                                        std::equal(kBegin.begin(), kBegin.end(), content.begin()));
}

// Time of the bathymetry header.
std::optional<Time> TimeOfPacket(Bytes packet) {
  ByteReader in(packet);
  in.Skip(kPacketHeaderBytes);
  const auto time = ReadTime(&in);
  const int hundredths = in.Le<std::uint8_t>();
  if (!in.ok() || !time || hundredths > 99) return std::nullopt;
  return *time + std::chrono::milliseconds(10 * hundredths);
}

std::optional<NavigationRecord> ReadAttitude(Bytes packet) {
  ByteReader in(packet);
  in.Skip(30);
  const double pitch_deg = in.Le<float>();
  const double roll_deg = in.Le<float>();
  const double heave_up_m = in.Le<float>();
  in.Skip(8);
  const double heading_deg = in.Le<float>();
  const auto time = ReadTime(&in);
  const int milliseconds = in.Le<std::uint16_t>();
  if (!in.ok() || !time || milliseconds > 999 || !std::isfinite(roll_deg) ||
      !std::isfinite(pitch_deg) || !std::isfinite(heave_up_m) || !std::isfinite(heading_deg))
    return std::nullopt;
  NavigationRecord sample;
  sample.source = "xtf_attitude";
  sample.time = *time + std::chrono::milliseconds(milliseconds);
  sample.attitude = AttitudeFromDegrees(roll_deg, pitch_deg, heading_deg);
  sample.heave_m = -heave_up_m;
  return sample;
}

std::optional<NavigationRecord> ReadPosition(Bytes packet) {
  ByteReader in(packet);
  in.Skip(14);
  const auto time = ReadTime(&in);
  const int tenths_of_ms = in.Le<std::uint16_t>();
  const double latitude_deg = in.Le<double>();
  const double longitude_deg = in.Le<double>();
  const double height_m = in.Le<double>();
  if (!in.ok() || !time || tenths_of_ms > 9999 || !(std::abs(latitude_deg) <= 90.0) ||
      !(std::abs(longitude_deg) <= 180.0))
    return std::nullopt;
  NavigationRecord sample;
  sample.source = "xtf_position";
  sample.time = *time + Duration(100 * tenths_of_ms);
  sample.position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
  if (std::isfinite(height_m)) sample.height_m = height_m;
  return sample;
}

}  // namespace

SurveyReader::Look XtfFileReader::LookAt(Bytes bytes, bool /*at_end*/) const {
  if (at_start_ && bytes[0] == kFileHeader)
    return bytes.size() < kFileHeaderBytes ? TooShort() : Record(SizeOfFileHeader(bytes));
  if (bytes.size() < kPacketHeaderBytes) return TooShort();
  ByteReader in(bytes);
  const auto magic = in.Le<std::uint16_t>();
  in.Skip(8);
  const std::size_t size = in.Le<std::uint32_t>();
  if (magic != kMagic || size < kPacketHeaderBytes || size > kMaxRecordBytes) return Damage();
  return Record(size);
}

void XtfFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  if (std::exchange(at_start_, false) && record[0] == kFileHeader) return ReadFileHeader(record);
  const std::uint8_t type = record[2];
  if (HoldsBth0(record)) {
    ReadPing(record, out);
  } else if (type == kAttitude) {
    if (!AppendRecords(ReadAttitude(record), out)) Count("xtf_malformed");
  } else if (type == kPosition) {
    if (!geographic_)
      Count("xtf_position_not_geographic");
    else if (!AppendRecords(ReadPosition(record), out))
      Count("xtf_malformed");
  } else {
    const auto name = kTypeNames.find(type);
    CountIgnored("xtf", name == kTypeNames.end() ? std::to_string(type) : name->second);
  }
}

void XtfFileReader::ReadFileHeader(Bytes header) {
  constexpr std::uint16_t kDegrees = 3;
  ByteReader in(header);
  in.Skip(164);
  geographic_ = in.Le<std::uint16_t>() == kDegrees;
}

void XtfFileReader::ReadPing(Bytes packet, std::vector<SurveyRecord>* out) {
  const std::uint8_t head = packet[3];
  const Bytes content = ContentOf(packet);
  // The packet may be longer than the sonar's own datagram: padding follows.
  ByteReader in(content);
  in.Skip(4);
  const std::size_t size = in.Be<std::uint32_t>();
  int unusable = 0;
  auto ping = DecodeBth0(content.first(std::min(size, content.size())), &unusable);
  if (!ping) return Count("xtf_malformed");
  if (unusable > 0) Count("mbes_beam_unusable", unusable);
  ping->head = head;
  // A sonar whose clock was not set.
  if (const auto time = TimeOfPacket(packet); time && !AreNear(ping->time, *time)) {
    Count("stamps_wrong");
    ping->time = SensorTime(ping->time, *time).value_or(*time);
  }
  out->emplace_back(std::move(*ping));
}

}  // namespace seastitch
