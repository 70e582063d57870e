#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/kongsberg/kmall_stream.hpp"
#include "common/core/pose.hpp"
#include "drivers/mbes/mbes_decoder.hpp"
#include "tests/codecs/mbes_pings.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

// KMALL datagrams, golden and made, for the tests of their codec.
namespace seastitch {

using ByteVector = std::vector<std::uint8_t>;

inline std::vector<ByteVector> DatagramsOf(const std::filesystem::path& file,
                                           const std::string& type) {
  const ByteVector all = BytesOf(file);
  std::vector<ByteVector> found;
  for (std::size_t at = 0; at + 8 <= all.size();) {
    const auto size = ByteReader(Bytes(all).subspan(at)).Le<std::uint32_t>();
    const std::string name(all.begin() + static_cast<std::ptrdiff_t>(at + 4),
                           all.begin() + static_cast<std::ptrdiff_t>(at + 8));
    const Bytes datagram = Bytes(all).subspan(at, size);
    if (name == type) found.emplace_back(datagram.begin(), datagram.end());
    at += size;
  }
  return found;
}

// A ping of three sectors with beams of every kind.
inline MbesPing Ping(std::size_t num_beams = 12) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'250'000);
  ping.ping_number = 4660;
  ping.sound_speed_mps = 1490.25;
  for (std::size_t i = 0; i < num_beams; ++i) {
    const auto number = static_cast<float>(i);
    MbesBeam beam;
    beam.twtt_s = 0.05f + 0.001f * number;
    beam.rx_angle_rad = -1.0f + 2.0f * number / static_cast<float>(num_beams);
    beam.tx_tilt_rad = static_cast<float>(Deg2Rad(0.5 * static_cast<double>(i % 3)));
    beam.tx_delay_s = 0.001f * static_cast<float>(i % 3);
    beam.depth_sigma_ratio = 0.0025f;
    beam.backscatter_db = -24.5f;
    beam.flags = i % 4 == 0 ? 0 : i % 4 == 1 ? kBeamAmplitude : kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  return ping;
}

inline KmallHeader Version(std::uint8_t version) {
  KmallHeader header;
  header.version = version;
  return header;
}

}  // namespace seastitch
