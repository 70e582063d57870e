#include "codecs/makers/wbms.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace seastitch {
namespace {

constexpr std::uint32_t kPreamble = 0xDEADBEEF;
constexpr std::uint32_t kBathymetryType = 1;
constexpr std::size_t kMaxBeams = 1024;
constexpr std::size_t kHeaderBytes = 24;
constexpr std::size_t kLongestPacket = 65'536;
constexpr double kLatestTime_s = 1e10;  // limit of a plausible time [s]
constexpr float kEncodedRate_Hz = 78'125.0f;

// Flags of a point: detected by magnitude, by phase.
constexpr std::uint16_t kMagnitude = 1;
constexpr std::uint16_t kPhase = 2;
constexpr std::uint8_t kTests = 3;  // quality tests passed: signal to noise, colinearity

// Sizes that differ between versions.
struct Layout {
  std::size_t sub_header_bytes;
  bool is_long;  // points of 48 bytes with fractional samples; false: 20 bytes
};

std::optional<Layout> LayoutOf(std::uint32_t version) {
  switch (version) {
    case 4:
    case 7: return Layout{88, false};
    case 5:
    case 6:
    case 8: return Layout{112, true};
    default: return std::nullopt;
  }
}

constexpr std::array<std::uint32_t, 256> MakeCrcTable() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t n = 0; n < table.size(); ++n) {
    std::uint32_t c = n;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
    table[n] = c;
  }
  return table;
}

// CRC-32 as in Ethernet.
std::uint32_t Crc32(Bytes bytes) {
  static constexpr std::array<std::uint32_t, 256> kTable = MakeCrcTable();
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) crc = kTable[(crc ^ byte) & 0xFF] ^ (crc >> 8);
  return ~crc;
}

struct Point {
  double sample = 0.0;
  float angle_rad = 0.0f;  // in the plane of the tilted fan, positive to starboard
  float intensity = 0.0f;
  std::uint16_t flags = 0;
  std::uint8_t tests = 0;
};

Point ReadPoint(bool is_long, ByteReader* in) {
  Point point;
  point.sample = is_long ? double{in->Le<float>()} : static_cast<double>(in->Le<std::uint32_t>());
  point.angle_rad = in->Le<float>();
  in->Skip(is_long ? 12 : 4);  // steering, gates
  point.intensity = in->Le<float>();
  if (is_long) in->Skip(4);
  point.flags = in->Le<std::uint16_t>();
  point.tests = in->Le<std::uint8_t>();
  in->Skip(is_long ? 17 : 1);
  return point;
}

// From an angle in the plane of a tilted fan to the receive angle of separate transmit and receive
// angles, and back. Angles of 90 degrees and more cannot be a bottom echo and are not converted.
float ReceiveAngle(float in_fan_rad, float tilt_rad) {
  if (!(std::abs(in_fan_rad) < 1.57f)) return in_fan_rad;
  return static_cast<float>(std::asin(std::sin(double{in_fan_rad}) * std::cos(double{tilt_rad})));
}
float AngleInFan(float receive_rad, float tilt_rad) {
  const double sine = std::sin(double{receive_rad}) / std::cos(double{tilt_rad});
  return static_cast<float>(std::asin(std::clamp(sine, -1.0, 1.0)));
}

MbesBeam BeamOf(const Point& point, double rate_Hz, float tilt_rad) {
  MbesBeam beam;
  beam.twtt_s = static_cast<float>(point.sample / rate_Hz);
  beam.rx_angle_rad = ReceiveAngle(point.angle_rad, tilt_rad);
  beam.tx_tilt_rad = tilt_rad;
  beam.backscatter_db = point.intensity > 0.0f ? 20.0f * std::log10(point.intensity) : 0.0f;
  if ((point.flags & kMagnitude) != 0) beam.flags |= kBeamAmplitude;
  if ((point.flags & kPhase) != 0) beam.flags |= kBeamPhase;
  if (beam.flags != 0 && (point.tests & kTests) == kTests) beam.flags |= kBeamValid;
  return beam;
}

}  // namespace

std::optional<std::size_t> SizeOfWbms(Bytes bytes) {
  for (std::size_t i = 0; i < std::min<std::size_t>(4, bytes.size()); ++i)
    if (bytes[i] != ((kPreamble >> (8 * i)) & 0xFF)) return std::nullopt;
  if (bytes.size() < kHeaderBytes) return 0;
  ByteReader in(bytes);
  in.Skip(8);
  const std::size_t size = in.Le<std::uint32_t>();
  in.Skip(8);
  const auto crc = in.Le<std::uint32_t>();
  if (size < kHeaderBytes || size > kLongestPacket) return std::nullopt;
  if (bytes.size() < size) return 0;
  if (Crc32(bytes.subspan(kHeaderBytes, size - kHeaderBytes)) != crc) return std::nullopt;
  return size;
}

WbmsKind KindOfWbms(Bytes packet) {
  ByteReader in(packet);
  in.Skip(4);
  const auto type = in.Le<std::uint32_t>();
  in.Skip(4);
  const auto version = in.Le<std::uint32_t>();
  if (type != kBathymetryType) return WbmsKind::kOther;
  return LayoutOf(version) ? WbmsKind::kBathymetry : WbmsKind::kOtherVersion;
}

std::optional<MbesPing> DecodeWbms(Bytes packet, int* unusable_beams) {
  if (KindOfWbms(packet) != WbmsKind::kBathymetry) return std::nullopt;
  ByteReader in(packet);
  in.Skip(12);
  const Layout layout = *LayoutOf(in.Le<std::uint32_t>());
  in.Skip(8);
  MbesPing ping;
  ping.sound_speed_mps = in.Le<float>();
  const double rate_Hz = in.Le<float>();
  const std::size_t n = in.Le<std::uint32_t>();
  ping.ping_number = in.Le<std::uint32_t>();
  const auto time_s = in.Le<double>();
  in.Skip(24);
  const auto tilt_rad = in.Le<float>();
  const bool sensible = in.ok() && n <= kMaxBeams && time_s > 0.0 && time_s < kLatestTime_s &&
                        std::isfinite(ping.sound_speed_mps) && ping.sound_speed_mps > 0.0 &&
                        std::isfinite(rate_Hz) && rate_Hz > 0.0;
  if (!sensible) return std::nullopt;
  ping.time = FromUtime(std::llround(time_s * 1e6));

  in.Skip(kHeaderBytes + layout.sub_header_bytes - in.at());
  int unusable = 0;
  ping.beams.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    const MbesBeam beam = BeamOf(ReadPoint(layout.is_long, &in), rate_Hz, tilt_rad);
    if (!IsUsable(beam)) ++unusable;
    ping.beams.push_back(IsUsable(beam) ? beam : MbesBeam{});
  }
  if (!in.ok()) return std::nullopt;
  if (unusable_beams != nullptr) *unusable_beams = unusable;
  return ping;
}

std::vector<std::uint8_t> EncodeWbms(const MbesPing& ping) {
  if (ping.beams.size() > kMaxBeams) throw std::invalid_argument("WBMS: more than 1024 beams");
  const float tilt_rad = ping.beams.empty() ? 0.0f : ping.beams[0].tx_tilt_rad;
  ByteWriter body;
  body.Le(static_cast<float>(ping.sound_speed_mps));
  body.Le(kEncodedRate_Hz);
  body.Le(static_cast<std::uint32_t>(ping.beams.size()));
  body.Le(ping.ping_number);
  body.Le(static_cast<double>(ToUtime(ping.time)) * 1e-6);
  body.Zeros(24);
  body.Le(tilt_rad);
  body.Zeros(60);
  for (const MbesBeam& beam : ping.beams) {
    body.Le(beam.twtt_s * kEncodedRate_Hz);
    body.Le(AngleInFan(beam.rx_angle_rad, tilt_rad));
    body.Zeros(12);
    body.Le(std::pow(10.0f, beam.backscatter_db / 20.0f));
    body.Zeros(4);
    body.Le(static_cast<std::uint16_t>(((beam.flags & kBeamAmplitude) != 0 ? kMagnitude : 0) |
                                       ((beam.flags & kBeamPhase) != 0 ? kPhase : 0)));
    body.Le(static_cast<std::uint8_t>((beam.flags & kBeamValid) != 0 ? kTests : 0));
    body.Zeros(17);
  }
  ByteWriter out;
  out.Le(kPreamble);
  out.Le(kBathymetryType);
  out.Le(static_cast<std::uint32_t>(kHeaderBytes + body.size()));
  out.Le(std::uint32_t{5});
  out.Zeros(4);
  out.Le(Crc32(body.bytes()));
  out.Append(body.bytes());
  return out.Release();
}

std::vector<MbesOutput> WbmsStream::Add(Bytes payload, Time recv, std::uint64_t /*sender*/) {
  std::vector<MbesOutput> outputs;
  for (const FrameStream::Frame& frame : frames_.Add(payload, recv)) {
    int unusable = 0;
    if (std::optional<MbesPing> ping = DecodeWbms(frame.bytes, &unusable))
      outputs.emplace_back(std::move(*ping));
    else if (const WbmsKind kind = KindOfWbms(frame.bytes); kind == WbmsKind::kBathymetry)
      ++counters_["wbms_malformed"];
    else
      ++counters_[kind == WbmsKind::kOther ? "wbms_ignored" : "wbms_version_unknown"];
    if (unusable > 0) counters_["mbes_beam_unusable"] += unusable;
  }
  return outputs;
}

Counters WbmsStream::counters() const {
  Counters all = counters_;
  if (frames_.skipped_bytes() > 0) all["wbms_skipped_bytes"] = frames_.skipped_bytes();
  return all;
}

}  // namespace seastitch
