#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "codecs/part_collector.hpp"
#include "common/core/bytes.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sensors.hpp"

namespace seastitch {

using MbesOutput = std::variant<MbesPing, SoundVelocityProfile>;

struct MbesCodecParams {
  PartCollectorParams parts;
  // Mounting roll of each receiver in the sonar's frame, by the number of the head; positive: it
  // looks to port. Heads beyond the list have 0.
  std::vector<double> head_roll_rad;
};

// The data format of one maker's sonar: datagrams, or pieces of a stream, to pings. One pair of
// files a format, and one line in mbes_decoder.cpp.
class MbesCodec {
 public:
  virtual ~MbesCodec() = default;

  // Decodes one payload. Pings have the sonar's time. recv: receive time, which orders parts
  // without a time. sender: distinguishes sonars that use the same ping numbers.
  virtual std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender) = 0;
  // Counts of rejected and lost data, by reason; the names begin with the format's.
  virtual Counters counters() const = 0;
};

// Rotates the receive angles of a head into the sonar's frame: subtracts the head's roll.
void TurnFromHead(std::size_t head, const std::vector<double>& head_roll_rad, MbesPing* ping);

// True: the beam has finite numbers, an angle within half a turn, and, if it is valid, a positive
// travel time. Decoders replace any other beam by zeros.
bool IsUsable(const MbesBeam& beam);

}  // namespace seastitch
