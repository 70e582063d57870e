#include "codecs/makers/s7k.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "codecs/calendar.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kNetworkFrameBytes = 36;
constexpr std::size_t kRecordFrameBytes = 64;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::uint16_t kVersion = 5;
constexpr std::uint32_t kSync = 0x0000FFFF;
constexpr std::uint32_t kSettings = 7000;
constexpr std::uint32_t kDetections = 7027;
constexpr std::uint16_t kChecksumValid = 1;  // a flag of the frame

constexpr std::size_t kMaxBeams = 1024;
constexpr std::uint16_t kMaxHead = 127;
constexpr std::size_t kMaxHalfPings = 8;
constexpr std::size_t kLeastDetectionBytes = 22;
constexpr std::size_t kDetectionBytes = 26;  // size that the writer uses: with signal strength

// Flags of a detection: how it was found.
enum DetectionFlag : std::uint32_t { kMagnitude = 1, kPhase = 2 };
constexpr std::uint32_t kBothTests = 3;  // of its quality: brightness and colinearity tests passed

std::uint32_t Sum(Bytes bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint32_t{0});
}

// "7kTIME": year, day of the year from 1, hour, minute, and seconds as a float.
std::optional<Time> ReadTime(ByteReader* in) {
  const int year = in->Le<std::uint16_t>();
  const int day = in->Le<std::uint16_t>();
  const float seconds = in->Le<float>();
  const int hours = in->Le<std::uint8_t>();
  const int minutes = in->Le<std::uint8_t>();
  const std::optional<Time> midnight = MidnightOfYearDay(year, day);
  const bool usable = midnight && hours < 24 && minutes < 60 && seconds >= 0.0f && seconds < 61.0f;
  if (!usable) return std::nullopt;
  return *midnight + std::chrono::hours(hours) + std::chrono::minutes(minutes) +
         FromSeconds(seconds);
}

void WriteTime(Time time, ByteWriter* out) {
  const std::chrono::sys_time<Duration> instant(time.time_since_epoch());
  const auto day = std::chrono::floor<std::chrono::days>(instant);
  const std::chrono::year_month_day date(day);
  const std::chrono::sys_days january_first(date.year() / 1 / 1);
  const std::chrono::hh_mm_ss clock(instant - day);
  out->Le(static_cast<std::uint16_t>(static_cast<int>(date.year())));
  out->Le(static_cast<std::uint16_t>((day - january_first).count() + 1));
  out->Le(static_cast<float>(ToSeconds(clock.seconds()) + ToSeconds(clock.subseconds())));
  out->Le(static_cast<std::uint8_t>(clock.hours().count()));
  out->Le(static_cast<std::uint8_t>(clock.minutes().count()));
}

ByteWriter PingHeader(const S7kPingId& id) {
  ByteWriter data;
  data.Zeros(8);  // serial number
  data.Le(id.ping_number);
  data.Le(id.multi_ping);
  return data;
}

S7kPingId ReadPingId(const S7kRecord& record, ByteReader* in) {
  in->Skip(8);
  S7kPingId id{record.device_id, record.head, 0, 0};
  id.ping_number = in->Le<std::uint32_t>();
  id.multi_ping = in->Le<std::uint16_t>();
  return id;
}

// sampling_hz: rate of the detection point's samples. sigma_given: the record states how its sigmas
// were estimated.
MbesBeam ReadDetection(Bytes detection, float sampling_hz, bool sigma_given) {
  ByteReader in(detection);
  in.Skip(2);
  MbesBeam beam;
  beam.twtt_s = in.Le<float>() / sampling_hz;
  beam.rx_angle_rad = in.Le<float>();
  const auto flags = in.Le<std::uint32_t>();
  const auto quality = in.Le<std::uint32_t>();
  const float sigma = in.Le<float>();
  if (sigma_given) beam.depth_sigma_ratio = std::max(sigma, 0.0f);
  if (in.left() >= 4) {
    const float strength = in.Le<float>();
    if (strength > 0.0f) beam.backscatter_db = 20.0f * std::log10(strength);
  }
  if ((flags & kMagnitude) != 0) beam.flags |= kBeamAmplitude;
  if ((flags & kPhase) != 0) beam.flags |= kBeamPhase;
  if (beam.flags != 0 && (quality & kBothTests) == kBothTests) beam.flags |= kBeamValid;
  return beam;
}

}  // namespace

std::uint8_t S7kHead(std::uint16_t system_enumerator) {
  return static_cast<std::uint8_t>(std::min(system_enumerator, kMaxHead));
}

std::optional<S7kRecord> ReadS7kRecord(Bytes bytes) {
  ByteReader in(bytes);
  const auto version = in.Le<std::uint16_t>();
  const std::size_t data_at = 4 + std::size_t{in.Le<std::uint16_t>()};
  const auto sync = in.Le<std::uint32_t>();
  S7kRecord record;
  record.size = in.Le<std::uint32_t>();
  const std::size_t optional_at = in.Le<std::uint32_t>();
  in.Skip(4);
  const std::optional<Time> time = ReadTime(&in);
  in.Skip(2);
  record.type = in.Le<std::uint32_t>();
  record.device_id = in.Le<std::uint32_t>();
  in.Skip(2);
  record.head = in.Le<std::uint16_t>();
  in.Skip(4);
  const auto flags = in.Le<std::uint16_t>();
  in.Skip(14);
  if (!in.ok() || version != kVersion || sync != kSync || !time || data_at < kRecordFrameBytes ||
      record.size > bytes.size() || record.size < data_at + kChecksumBytes)
    return std::nullopt;

  const std::size_t checksum_at = record.size - kChecksumBytes;
  const std::size_t data_end = optional_at == 0 ? checksum_at : optional_at;
  if (data_end < data_at || data_end > checksum_at) return std::nullopt;
  record.time = *time;
  record.data = bytes.subspan(data_at, data_end - data_at);
  if ((flags & kChecksumValid) != 0) {
    const auto given = ByteReader(bytes.subspan(checksum_at)).Le<std::uint32_t>();
    // The specification sums the bytes after the frame; real implementations sum all of it.
    if (given != Sum(bytes.first(checksum_at)) &&
        given != Sum(bytes.subspan(data_at, checksum_at - data_at)))
      return std::nullopt;
  }
  return record;
}

std::optional<S7kSettings> DecodeS7k7000(const S7kRecord& record) {
  ByteReader in(record.data);
  S7kSettings settings;
  settings.id = ReadPingId(record, &in);
  in.Skip(132);
  settings.sound_speed_mps = in.Le<float>();
  const bool usable = in.ok() && record.type == kSettings &&
                      std::isfinite(settings.sound_speed_mps) && settings.sound_speed_mps > 0.0;
  return usable ? std::optional(settings) : std::nullopt;
}

std::optional<S7kDetections> DecodeS7k7027(const S7kRecord& record, int* unusable_beams) {
  ByteReader in(record.data);
  S7kDetections out;
  out.id = ReadPingId(record, &in);
  const std::size_t num_beams = in.Le<std::uint32_t>();
  const std::size_t bytes_each = in.Le<std::uint32_t>();
  in.Skip(1);
  const bool sigma_given = (in.Le<std::uint32_t>() & 0xF) != 0;
  const float sampling_hz = in.Le<float>();
  const float tilt_rad = in.Le<float>();
  in.Skip(4 + 60);
  const bool usable = in.ok() && record.type == kDetections && num_beams <= kMaxBeams &&
                      bytes_each >= kLeastDetectionBytes && std::isfinite(sampling_hz) &&
                      sampling_hz > 0.0f && std::isfinite(tilt_rad);
  if (!usable || in.left() / bytes_each < num_beams) return std::nullopt;

  out.ping.time = record.time;
  out.ping.ping_number = out.id.ping_number;
  out.ping.head = S7kHead(out.id.head);
  int unusable = 0;
  out.ping.beams.reserve(num_beams);
  for (std::size_t i = 0; i < num_beams; ++i) {
    MbesBeam beam = ReadDetection(in.Take(bytes_each), sampling_hz, sigma_given);
    beam.tx_tilt_rad = tilt_rad;
    if (!IsUsable(beam)) ++unusable;
    out.ping.beams.push_back(IsUsable(beam) ? beam : MbesBeam{});
  }
  if (unusable_beams != nullptr) *unusable_beams = unusable;
  return out;
}

std::vector<std::uint8_t> EncodeS7kRecord(std::uint32_t type,
                                          const S7kPingId& id,
                                          Time time,
                                          Bytes data) {
  ByteWriter out;
  out.Le(kVersion);
  out.Le(std::uint16_t{60});  // from the sync pattern to the data
  out.Le(kSync);
  out.Le(static_cast<std::uint32_t>(kRecordFrameBytes + data.size() + kChecksumBytes));
  out.Zeros(8);  // no optional data
  WriteTime(time, &out);
  out.Le(std::uint16_t{1});
  out.Le(type);
  out.Le(id.device_id);
  out.Zeros(2);
  out.Le(id.head);
  out.Zeros(4);
  out.Le(kChecksumValid);
  out.Zeros(14);
  out.Append(data);
  out.Le(Sum(out.bytes()));
  return out.Release();
}

std::vector<std::uint8_t> EncodeS7k7000(const S7kPingId& id, Time time, double sound_speed_mps) {
  ByteWriter data = PingHeader(id);
  data.Zeros(132);
  data.Le(static_cast<float>(sound_speed_mps));
  data.Zeros(6);
  return EncodeS7kRecord(kSettings, id, time, data.bytes());
}

std::vector<std::uint8_t> EncodeS7k7027(const S7kPingId& id, const MbesPing& ping) {
  constexpr float kSampling_hz = 34'482.758f;
  ByteWriter data = PingHeader(id);
  data.Le(static_cast<std::uint32_t>(ping.beams.size()));
  data.Le(static_cast<std::uint32_t>(kDetectionBytes));
  data.Zeros(1);
  data.Le(std::uint32_t{1});  // uncertainties are given
  data.Le(kSampling_hz);
  data.Le(ping.beams.empty() ? 0.0f : ping.beams[0].tx_tilt_rad);
  data.Zeros(4 + 60);
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    const MbesBeam& beam = ping.beams[i];
    std::uint32_t flags = 0;
    if ((beam.flags & kBeamAmplitude) != 0) flags |= kMagnitude;
    if ((beam.flags & kBeamPhase) != 0) flags |= kPhase;
    data.Le(static_cast<std::uint16_t>(i));
    data.Le(beam.twtt_s * kSampling_hz);
    data.Le(beam.rx_angle_rad);
    data.Le(flags);
    data.Le((beam.flags & kBeamValid) != 0 ? kBothTests : 0);
    data.Le(beam.depth_sigma_ratio);
    data.Le(std::pow(10.0f, beam.backscatter_db / 20.0f));
  }
  return EncodeS7kRecord(kDetections, id, ping.time, data.bytes());
}

std::vector<std::vector<std::uint8_t>> FrameS7k(Bytes record,
                                                std::uint16_t transmission_id,
                                                std::size_t max_bytes) {
  if (max_bytes < 64 || max_bytes > 60'000)
    throw std::invalid_argument("7k packets: 64 to 60000 bytes");
  const std::size_t slice_bytes = max_bytes - kNetworkFrameBytes;
  const std::size_t num_packets = (record.size() + slice_bytes - 1) / slice_bytes;
  std::vector<std::vector<std::uint8_t>> packets;
  for (std::size_t i = 0; i < num_packets; ++i) {
    const Bytes slice =
        record.subspan(i * slice_bytes, std::min(slice_bytes, record.size() - i * slice_bytes));
    ByteWriter out;
    out.Le(kVersion);
    out.Le(static_cast<std::uint16_t>(kNetworkFrameBytes));
    out.Le(static_cast<std::uint32_t>(num_packets));
    out.Le(std::uint16_t{1});  // records
    out.Le(transmission_id);
    out.Le(static_cast<std::uint32_t>(kNetworkFrameBytes + slice.size()));
    out.Le(static_cast<std::uint32_t>(record.size()));
    out.Le(static_cast<std::uint32_t>(i));
    out.Zeros(8);
    out.Le(std::uint32_t{7000});  // from 7k Center
    out.Append(slice);
    packets.push_back(out.Release());
  }
  return packets;
}

S7kStream::S7kStream(const MbesCodecParams& params)
    : head_roll_rad_(params.head_roll_rad),
      max_packets_(static_cast<std::size_t>(params.parts.max_parts)),
      pings_(FromSeconds(params.parts.max_age_s)),
      collector_(params.parts) {}

std::vector<MbesOutput> S7kStream::Add(Bytes payload, Time recv, std::uint64_t sender) {
  const std::optional<std::vector<std::uint8_t>> records = Join(payload, recv, sender);
  pings_.GiveUpOld(recv);
  std::vector<MbesOutput> out;
  for (Bytes left = records ? Bytes(*records) : Bytes(); !left.empty();) {
    const std::optional<S7kRecord> record = ReadS7kRecord(left);
    if (!record) {
      ++counters_["s7k_malformed"];
      break;
    }
    ReadRecord(*record, recv, sender, &out);
    left = left.subspan(record->size);
  }
  return out;
}

std::optional<std::vector<std::uint8_t>> S7kStream::Join(Bytes packet,
                                                         Time recv,
                                                         std::uint64_t sender) {
  ByteReader in(packet);
  const auto version = in.Le<std::uint16_t>();
  const std::size_t offset = in.Le<std::uint16_t>();
  const std::size_t num_packets = in.Le<std::uint32_t>();
  in.Skip(2);
  Transmission key{sender, 0, in.Le<std::uint16_t>(), 0};
  const std::size_t packet_bytes = in.Le<std::uint32_t>();
  key.total_bytes = in.Le<std::uint32_t>();
  const std::size_t number = in.Le<std::uint32_t>();
  in.Skip(8);
  key.device_id = in.Le<std::uint32_t>();
  const bool usable = in.ok() && version == kVersion && packet_bytes == packet.size() &&
                      offset >= kNetworkFrameBytes && offset < packet.size() &&
                      number < num_packets && num_packets <= max_packets_;
  std::optional<std::vector<std::vector<std::uint8_t>>> parts;
  if (usable) {
    parts = collector_.Add(key, num_packets, number, packet.subspan(offset), recv);
    if (!parts) return std::nullopt;
  }
  ByteWriter whole;
  if (parts)
    for (const std::vector<std::uint8_t>& part : *parts) whole.Append(part);
  if (!parts || whole.size() != key.total_bytes) {
    ++counters_["s7k_malformed"];
    return std::nullopt;
  }
  return whole.Release();
}

void S7kStream::ReadRecord(const S7kRecord& record,
                           Time recv,
                           std::uint64_t sender,
                           std::vector<MbesOutput>* out) {
  if (!S7kPings::Takes(record)) {
    ++counters_["s7k_ignored"];
    return;
  }
  std::optional<MbesPing> ping = pings_.Add(record, recv, sender);
  if (!ping) return;
  TurnFromHead(ping->head, head_roll_rad_, &*ping);
  out->push_back(std::move(*ping));
}

Counters S7kStream::counters() const {
  Counters all = counters_;
  for (const auto& [name, value] : pings_.counters()) all[name] += value;
  if (collector_.lost() > 0) all["s7k_transmission_incomplete"] = collector_.lost();
  return all;
}

bool S7kPings::Takes(const S7kRecord& record) {
  return record.type == kSettings || record.type == kDetections;
}

std::optional<MbesPing> S7kPings::Add(const S7kRecord& record, Time now, std::uint64_t sender) {
  HalfPing* const half = HalfPingOf(record, now, sender);
  if (half == nullptr) {
    ++counters_["s7k_malformed"];
    return std::nullopt;
  }
  if (!half->sound_speed_mps || !half->detections) return std::nullopt;
  any_joined_ = true;
  MbesPing ping = std::move(*half->detections);
  ping.sound_speed_mps = *half->sound_speed_mps;
  std::erase_if(half_pings_, [half](const HalfPing& p) { return &p == half; });
  return ping;
}

S7kPings::HalfPing* S7kPings::HalfPingOf(const S7kRecord& record, Time now, std::uint64_t sender) {
  if (record.type == kSettings) {
    const std::optional<S7kSettings> settings = DecodeS7k7000(record);
    if (!settings) return nullptr;
    HalfPing& half = HalfPingFor(sender, settings->id, now);
    half.sound_speed_mps = last_speed_mps_ = settings->sound_speed_mps;
    return &half;
  }
  int unusable = 0;
  std::optional<S7kDetections> detections = DecodeS7k7027(record, &unusable);
  if (!detections) return nullptr;
  if (unusable > 0) counters_["mbes_beam_unusable"] += unusable;
  HalfPing& half = HalfPingFor(sender, detections->id, now);
  half.detections = std::move(detections->ping);
  return &half;
}

void S7kPings::GiveUpFirst() {
  HalfPing& first = half_pings_.front();
  ++counters_[first.detections ? "s7k_ping_without_settings" : "s7k_ping_without_detections"];
  if (first.detections && !any_joined_) {
    first.detections->sound_speed_mps = last_speed_mps_;
    without_settings_.push_back(std::move(*first.detections));
    if (without_settings_.size() > kMaxHalfPings) without_settings_.pop_front();
  }
  half_pings_.pop_front();
}

// Drops old halves of pings. After a restart the sonar repeats its numbers, and halves of different
// pings must not be joined.
void S7kPings::GiveUpOld(Time now) {
  while (!half_pings_.empty() && now - half_pings_.front().since > max_age_) GiveUpFirst();
}

S7kPings::HalfPing& S7kPings::HalfPingFor(std::uint64_t sender, const S7kPingId& id, Time now) {
  for (HalfPing& ping : half_pings_)
    if (ping.sender == sender && ping.id == id) return ping;
  if (half_pings_.size() >= kMaxHalfPings) GiveUpFirst();
  return half_pings_.emplace_back(HalfPing{sender, id, now, std::nullopt, std::nullopt});
}

}  // namespace seastitch
