#include "codecs/makers/s7k_file.hpp"

#include <string>
#include <utility>

#include "codecs/makers/s7k_sensors.hpp"

namespace seastitch {

SurveyReader::Look S7kFileReader::LookAt(Bytes bytes, bool /*at_end*/) const {
  constexpr std::size_t kUpToSize = 12;
  constexpr std::size_t kLeastBytes = 68;
  constexpr std::uint16_t kVersion = 5;
  constexpr std::uint32_t kSync = 0x0000FFFF;
  if (bytes.size() < kUpToSize) return TooShort();
  ByteReader in(bytes);
  const auto version = in.Le<std::uint16_t>();
  in.Skip(2);
  const auto sync = in.Le<std::uint32_t>();
  const std::size_t size = in.Le<std::uint32_t>();
  if (version != kVersion || sync != kSync || size < kLeastBytes || size > kMaxRecordBytes)
    return Damage();
  if (bytes.size() < size) return Record(size);
  return ReadS7kRecord(bytes.first(size)) ? Record(size) : Damage();
}

void S7kFileReader::Read(Bytes record_bytes, std::vector<SurveyRecord>* out) {
  const S7kRecord record = *ReadS7kRecord(record_bytes);
  if (S7kPings::Takes(record)) {
    AppendRecords(pings_.Add(record, record.time, 0), out);
    GiveUpOld(record.time, out);
  } else if (record.type == 7030) {
    ReadInstallation(record, out);
  } else if (!ReadSensor(record, out)) {
    Count("s7k_malformed");
  }
}

void S7kFileReader::End(std::vector<SurveyRecord>* out) { GiveUpOld(Time::max(), out); }

void S7kFileReader::GiveUpOld(Time now, std::vector<SurveyRecord>* out) {
  pings_.GiveUpOld(now);
  for (MbesPing& ping : pings_.TakeWithoutSettings()) out->emplace_back(std::move(ping));
}

// Each head has a record of its own. A record given has all heads known so far.
void S7kFileReader::ReadInstallation(const S7kRecord& record, std::vector<SurveyRecord>* out) {
  auto installation = DecodeS7k7030(record);
  if (!installation) return Count("s7k_malformed");
  const std::size_t head = S7kHead(record.head);
  arrays_[head] = {installation->transmitters[0], installation->receivers[0]};
  if (arrays_.size() > 1) {
    // A head without a record of its own has the arrays of the one before.
    Arrays arrays = arrays_.begin()->second;
    installation->transmitters.clear();
    installation->receivers.clear();
    for (std::size_t i = 0; i <= arrays_.rbegin()->first; ++i) {
      if (const auto found = arrays_.find(i); found != arrays_.end()) arrays = found->second;
      installation->transmitters.push_back(arrays.transmitter);
      installation->receivers.push_back(arrays.receiver);
    }
  }
  out->emplace_back(std::move(*installation));
}

bool S7kFileReader::ReadSensor(const S7kRecord& record, std::vector<SurveyRecord>* out) {
  switch (record.type) {
    case 1003: return AppendRecords(DecodeS7k1003(record), out);
    case 1009: return AppendRecords(DecodeS7k1009(record), out);
    case 1012: return AppendRecords(DecodeS7k1012(record), out);
    case 1013: return AppendRecords(DecodeS7k1013(record), out);
    case 1015: return AppendRecords(DecodeS7k1015(record), out);
    case 1016: return AppendRecords(DecodeS7k1016(record), out);
    default: CountIgnored("s7k", std::to_string(record.type)); return true;
  }
}

Counters S7kFileReader::counters() const {
  Counters all = SurveyReader::counters();
  for (const auto& [name, value] : pings_.counters()) all[name] += value;
  return all;
}

}  // namespace seastitch
