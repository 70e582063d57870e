#include "codecs/kongsberg/kmall_file.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"

namespace seastitch {

SurveyReader::Look KmallFileReader::LookAt(Bytes bytes, bool /*at_end*/) const {
  if (bytes.size() < kKmallHeaderBytes) return TooShort();
  const std::size_t size = ByteReader(bytes).Le<std::uint32_t>();
  const std::string type(bytes.begin() + 4, bytes.begin() + 8);
  if (!IsKmallTypeName(type) || size < kKmallHeaderBytes + kKmallTailBytes ||
      size > kMaxRecordBytes)
    return Damage();
  if (bytes.size() < size) return Record(size);
  const auto tail = ByteReader(bytes.subspan(size - kKmallTailBytes)).Le<std::uint32_t>();
  return tail == size && ReadKmallHeader(bytes.first(size)) ? Record(size) : Damage();
}

void KmallFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  const KmallHeader header = *ReadKmallHeader(record);
  if (header.Is("#MRZ"))
    ReadPing(record, out);
  else if (!ReadSensor(header, record, out))
    Count("kmall_malformed");
}

bool KmallFileReader::ReadSensor(const KmallHeader& header,
                                 Bytes datagram,
                                 std::vector<SurveyRecord>* out) {
  if (header.Is("#SKM")) {
    auto motion = WithRightStamps(header, DecodeSkm(datagram));
    if (motion)
      for (NavigationRecord& sample : *motion) sample.time -= DelayOf("ATTI_", sample.source);
    return AppendRecords(std::move(motion), out);
  }
  if (header.Is("#SPO")) return ReadPosition(header, datagram, out);
  if (header.Is("#SVP")) return AppendRecords(DecodeSvp(datagram), out);
  if (header.Is("#SCL") && AppendRecords(DecodeScl(datagram), out)) return true;
  if (header.Is("#SVT")) return AppendRecords(WithRightStamps(header, DecodeSvt(datagram)), out);
  if (header.Is("#IIP")) {
    auto installation = DecodeIip(datagram);
    if (installation) installation_ = *installation;
    return AppendRecords(std::move(installation), out);
  }
  if (header.Is("#IOP")) return AppendRecords(DecodeIop(datagram), out);
  CountIgnored("kmall", std::string(header.type.begin() + 1, header.type.end()));
  return true;
}

Duration KmallFileReader::DelayOf(const std::string& kind, const std::string& source) const {
  constexpr double kMostS = 60.0;
  // Records of system 0 ("#SKM0") are those of sensor 1 ("ATTI_1").
  const std::string name = kind + std::to_string(std::stoi(source.substr(4)) + 1);
  const InstalledSensor* const sensor = installation_.SensorOf(name);
  const bool usable = sensor != nullptr && std::abs(sensor->delay_s) < kMostS;
  return usable ? FromSeconds(sensor->delay_s) : Duration{};
}

std::optional<Time> KmallFileReader::RightStamp(const KmallHeader& header, Time stamp) {
  if (!AreNear(stamp, header.time())) Count("stamps_wrong");
  return SensorTime(stamp, header.time());
}

template <class Sample>
std::optional<std::vector<Sample>> KmallFileReader::WithRightStamps(
    const KmallHeader& header, std::optional<std::vector<Sample>> samples) {
  if (!samples) return std::nullopt;
  std::vector<Sample> right;
  for (Sample& sample : *samples) {
    const std::optional<Time> time = RightStamp(header, sample.time);
    if (!time) continue;
    sample.time = *time;
    right.push_back(std::move(sample));
  }
  return right;
}

// A position whose own stamp is wrong has the time of its arrival.
bool KmallFileReader::ReadPosition(const KmallHeader& header,
                                   Bytes datagram,
                                   std::vector<SurveyRecord>* out) {
  auto position = DecodeSpo(datagram);
  if (position)
    position->time = RightStamp(header, position->time).value_or(header.time()) -
                     DelayOf("POSI_", position->source);
  return AppendRecords(std::move(position), out);
}

void KmallFileReader::ReadPing(Bytes datagram, std::vector<SurveyRecord>* out) {
  if (ReadKmallHeader(datagram)->version > kNewestMrz) {
    if (!IsWholeMrz(datagram)) return Count("kmall_version_unknown");
    Count("kmall_version_newer");
  }
  if (datagram.size() < kKmallHeaderBytes + kKmallPartitionBytes + kKmallTailBytes)
    return Count("kmall_malformed");
  const auto whole = reassembler_.Add(datagram);
  if (!whole) return;
  int unusable = 0;
  auto ping = DecodeMrz(*whole, &unusable);
  if (!ping) return Count("kmall_malformed");
  if (unusable > 0) Count("mbes_beam_unusable", unusable);
  auto soundings = DecodeMrzSoundings(*whole);
  if (!soundings) return Count("kmall_ping_empty");
  AppendRecords(DecodeMrzNavigation(*whole), out);
  out->emplace_back(std::move(*ping));
  out->emplace_back(std::move(*soundings));
}

Counters KmallFileReader::counters() const {
  Counters all = SurveyReader::counters();
  for (const auto& [name, value] : reassembler_.counters()) all[name] += value;
  return all;
}

}  // namespace seastitch
