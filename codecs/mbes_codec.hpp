#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "codecs/part_collector.hpp"
#include "common/core/bytes.hpp"
#include "common/core/counters.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {

using MbesOutput = std::variant<MbesPing, SoundVelocityProfile>;

struct MbesCodecParams {
  PartCollectorParams parts;
  // How far each receiver is rolled in the sonar's frame (positive: it looks to port), by the
  // number that the sonar gives it. Those beyond the list are not rolled.
  std::vector<double> head_roll_rad;
};

// The data format of one maker's sonar: datagrams, or pieces of a stream, to pings. One pair of files a format, and one
// line in mbes_decoder.cpp.
class MbesCodec {
 public:
  virtual ~MbesCodec() = default;

  // Pings have the time of the sonar. `recv` orders parts that carry no time; `sender`
  // distinguishes systems that use the same numbers.
  virtual std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender) = 0;
  // What was refused or lost, by cause; the names begin with that of the format.
  virtual Counters counters() const = 0;
};

// Turns the receive angles of a head into the sonar's frame.
void TurnFromHead(std::size_t head, const std::vector<double>& head_roll_rad, MbesPing* ping);

// What a beam must be to be given on: finite numbers, an angle within half a turn, and behind the
// transmission if it is valid. Any other keeps its place as zeros.
bool IsUsable(const MbesBeam& beam);

}  // namespace seastitch
