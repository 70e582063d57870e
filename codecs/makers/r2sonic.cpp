#include "codecs/makers/r2sonic.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace seastitch {
namespace {

constexpr std::size_t kMaxBeams = 1024;
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kH0Bytes = 116;
constexpr int kInfoFloats = 6;

// The four quality bits of a beam.
enum Quality : std::uint8_t {
  kColinear = 1,
  kBright = 2,
  kMagnitude = 4,
  kPhase = 8,
  kTests = kColinear | kBright,
};

bool StartsWith(Bytes bytes, std::string_view name) {
  return bytes.size() >= name.size() && std::equal(name.begin(), name.end(), bytes.begin());
}

// The content of each known section, after its name and size; empty if absent.
struct Sections {
  Bytes h0, r0, a0, a2, i1, q0;
};

std::optional<Sections> ReadSections(Bytes datagram) {
  ByteReader in(datagram);
  in.Skip(4);
  if (in.Be<std::uint32_t>() != datagram.size()) return std::nullopt;
  in.Skip(4);
  Sections sections;
  while (in.ok() && in.left() > 0) {
    const Bytes name = in.Take(2);
    const std::size_t size = in.Be<std::uint16_t>();
    if (size < 4) return std::nullopt;
    const Bytes content = in.Take(size - 4);
    if (!in.ok()) return std::nullopt;
    for (const auto& [known, section] : {std::pair{"H0", &sections.h0},
                                         {"R0", &sections.r0},
                                         {"A0", &sections.a0},
                                         {"A2", &sections.a2},
                                         {"I1", &sections.i1},
                                         {"Q0", &sections.q0}})
      if (StartsWith(name, known)) *section = content;
  }
  return in.ok() ? std::optional(sections) : std::nullopt;
}

// A scale, then one step number per beam.
bool ReadScaled(ByteReader* in, std::vector<float>* values) {
  const double scale = in->Be<float>();
  for (float& value : *values) value = static_cast<float>(scale * in->Be<std::uint16_t>());
  return in->ok();
}

bool ReadAngles(const Sections& sections, std::vector<float>* angles) {
  const std::size_t n = angles->size();
  const bool equidistant = !sections.a2.empty();
  ByteReader in(equidistant ? sections.a2 : sections.a0);
  const double first = in.Be<float>();
  if (!equidistant) {
    const double last = in.Be<float>();
    const double step = n > 1 ? (last - first) / static_cast<double>(n - 1) : 0.0;
    for (std::size_t i = 0; i < n; ++i)
      (*angles)[i] = static_cast<float>(first + static_cast<double>(i) * step);
    return in.ok();
  }
  const double scale = in.Be<float>();
  in.Skip(4 * kInfoFloats);
  std::uint32_t steps = 0;
  for (float& angle : *angles) {
    steps += in.Be<std::uint16_t>();
    angle = static_cast<float>(first + scale * steps);
  }
  return in.ok();
}

// Four bits per beam, eight beams per word, the first beam in the highest bits. 0 if not given.
bool ReadQuality(Bytes q0, std::vector<std::uint8_t>* quality) {
  if (q0.empty()) return true;
  ByteReader in(q0);
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < quality->size(); ++i) {
    if (i % 8 == 0) word = in.Be<std::uint32_t>();
    (*quality)[i] = static_cast<std::uint8_t>((word >> (4 * (7 - i % 8))) & 0xF);
  }
  return in.ok();
}

std::uint8_t Flags(std::uint8_t quality) {
  std::uint8_t flags = 0;
  if ((quality & kMagnitude) != 0) flags |= kBeamAmplitude;
  if ((quality & kPhase) != 0) flags |= kBeamPhase;
  if (flags != 0 && (quality & kTests) == kTests) flags |= kBeamValid;
  return flags;
}

std::uint8_t QualityOf(std::uint8_t flags) {
  int quality = (flags & kBeamValid) != 0 ? kTests : 0;
  if ((flags & kBeamAmplitude) != 0) quality |= kMagnitude;
  if ((flags & kBeamPhase) != 0) quality |= kPhase;
  return static_cast<std::uint8_t>(quality);
}

float Micropascal(float db) { return std::pow(10.0f, db / 20.0f); }

void WriteSection(std::string_view name, const ByteWriter& content, ByteWriter* out) {
  for (const char c : name) out->Be(static_cast<std::uint8_t>(c));
  const std::size_t padded = (content.size() + 3) / 4 * 4;
  out->Be(static_cast<std::uint16_t>(4 + padded));
  out->Append(content.bytes());
  out->Zeros(padded - content.size());
}

// Writes values, none negative, with the scale that maps the largest to the highest step.
void WriteScaled(const std::vector<double>& values, ByteWriter* out) {
  const double largest = values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
  const auto scale = static_cast<float>(largest > 0.0 ? largest / 65535.0 : 1.0);
  out->Be(scale);
  for (const double value : values)
    out->Be(static_cast<std::uint16_t>(std::clamp(std::round(value / scale), 0.0, 65535.0)));
}

ByteWriter EncodeH0(const MbesPing& ping) {
  const std::int64_t utime = ToUtime(ping.time);
  ByteWriter h0;
  h0.Zeros(24);  // model and serial number
  h0.Be(static_cast<std::uint32_t>(utime / 1'000'000));
  h0.Be(static_cast<std::uint32_t>(utime % 1'000'000 * 1000));
  h0.Be(ping.ping_number);
  h0.Zeros(4);
  h0.Be(static_cast<float>(ping.sound_speed_mps));
  h0.Zeros(20);
  h0.Be(ping.beams.empty() ? 0.0f : ping.beams[0].tx_tilt_rad);
  h0.Zeros(42);
  h0.Be(static_cast<std::uint16_t>(ping.beams.size()));
  return h0;
}

ByteWriter EncodeA2(const MbesPing& ping) {
  const auto angle = [&ping](std::size_t i) { return double{ping.beams[i].rx_angle_rad}; };
  double largest = 0.0;
  for (std::size_t i = 1; i < ping.beams.size(); ++i) {
    if (angle(i) < angle(i - 1)) throw std::invalid_argument("BTH0: angles must rise");
    largest = std::max(largest, angle(i) - angle(i - 1));
  }
  const auto first = static_cast<float>(ping.beams.empty() ? 0.0 : angle(0));
  const auto scale = static_cast<float>(largest > 0.0 ? largest / 65000.0 : 1.0);
  ByteWriter a2;
  a2.Be(first);
  a2.Be(scale);
  a2.Zeros(4 * kInfoFloats);
  std::int64_t steps = 0;
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    // Difference of rounded sums, so that rounding errors do not accumulate.
    const auto next = static_cast<std::int64_t>(std::round((angle(i) - first) / double{scale}));
    a2.Be(static_cast<std::uint16_t>(next - steps));
    steps = next;
  }
  return a2;
}

ByteWriter EncodeQ0(const MbesPing& ping) {
  ByteWriter q0;
  for (std::size_t begin = 0; begin < ping.beams.size(); begin += 8) {
    std::uint32_t word = 0;
    for (std::size_t i = begin; i < std::min(begin + 8, ping.beams.size()); ++i)
      word |= std::uint32_t{QualityOf(ping.beams[i].flags)} << (4 * (7 - i % 8));
    q0.Be(word);
  }
  return q0;
}

}  // namespace

std::optional<MbesPing> DecodeBth0(Bytes datagram, int* unusable_beams) {
  if (!StartsWith(datagram, "BTH0")) return std::nullopt;
  const std::optional<Sections> sections = ReadSections(datagram);
  if (!sections || sections->h0.size() < kH0Bytes - 4) return std::nullopt;

  MbesPing ping;
  ByteReader h0(sections->h0);
  h0.Skip(24);
  const auto time_s = h0.Be<std::uint32_t>();
  const auto time_ns = h0.Be<std::uint32_t>();
  ping.time = FromUtime(std::int64_t{time_s} * 1'000'000 + (std::int64_t{time_ns} + 500) / 1000);
  ping.ping_number = h0.Be<std::uint32_t>();
  h0.Skip(4);
  ping.sound_speed_mps = h0.Be<float>();
  h0.Skip(20);
  const float tilt_rad = h0.Be<float>();
  h0.Skip(42);
  const std::size_t n = h0.Be<std::uint16_t>();
  const bool sensible = time_s > 0 && time_ns < 1'000'000'000 && n <= kMaxBeams &&
                        std::isfinite(ping.sound_speed_mps) && ping.sound_speed_mps > 0.0;
  if (!sensible) return std::nullopt;

  std::vector<float> times_s(n), angles_rad(n), intensities_upa(n);
  std::vector<std::uint8_t> quality(n);
  ByteReader r0(sections->r0);
  ByteReader i1(sections->i1);
  if (!ReadScaled(&r0, &times_s) || !ReadAngles(*sections, &angles_rad) ||
      (!sections->i1.empty() && !ReadScaled(&i1, &intensities_upa)) ||
      !ReadQuality(sections->q0, &quality))
    return std::nullopt;

  int unusable = 0;
  ping.beams.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    MbesBeam beam;
    beam.twtt_s = times_s[i];
    beam.rx_angle_rad = angles_rad[i];
    beam.tx_tilt_rad = tilt_rad;
    beam.backscatter_db = intensities_upa[i] > 0.0f ? 20.0f * std::log10(intensities_upa[i]) : 0.0f;
    beam.flags = Flags(quality[i]);
    if (!IsUsable(beam)) ++unusable;
    ping.beams.push_back(IsUsable(beam) ? beam : MbesBeam{});
  }
  if (unusable_beams != nullptr) *unusable_beams = unusable;
  return ping;
}

std::vector<std::uint8_t> EncodeBth0(const MbesPing& ping) {
  if (ping.beams.size() > kMaxBeams) throw std::invalid_argument("BTH0: more than 1024 beams");
  std::vector<double> times_s;
  std::vector<double> intensities_upa;
  for (const MbesBeam& beam : ping.beams) {
    times_s.push_back(beam.twtt_s);
    intensities_upa.push_back(Micropascal(beam.backscatter_db));
  }
  ByteWriter r0;
  ByteWriter i1;
  WriteScaled(times_s, &r0);
  WriteScaled(intensities_upa, &i1);
  ByteWriter body;
  WriteSection("H0", EncodeH0(ping), &body);
  WriteSection("R0", r0, &body);
  WriteSection("A2", EncodeA2(ping), &body);
  WriteSection("I1", i1, &body);
  WriteSection("Q0", EncodeQ0(ping), &body);

  ByteWriter out;
  for (const char c : {'B', 'T', 'H', '0'}) out.Be(static_cast<std::uint8_t>(c));
  out.Be(static_cast<std::uint32_t>(kHeaderBytes + body.size()));
  out.Zeros(4);
  out.Append(body.bytes());
  return out.Release();
}

std::vector<MbesOutput> R2SonicStream::Add(Bytes payload, Time /*recv*/, std::uint64_t /*sender*/) {
  int unusable = 0;
  std::optional<MbesPing> ping = DecodeBth0(payload, &unusable);
  if (!ping) {
    const bool other = payload.size() >= kHeaderBytes && !StartsWith(payload, "BTH0");
    ++counters_[other ? "r2sonic_ignored" : "r2sonic_malformed"];
    return {};
  }
  if (unusable > 0) counters_["mbes_beam_unusable"] += unusable;
  return {std::move(*ping)};
}

}  // namespace seastitch
