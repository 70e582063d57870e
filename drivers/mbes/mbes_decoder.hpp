#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "codecs/mbes_codec.hpp"
#include "drivers/device_clock.hpp"

namespace seastitch {

struct MbesDecoderParams {
  std::string format = "kmall";  // one of MbesFormats()
  ClockParams clock;
  MbesCodecParams codec;
};

std::vector<std::string> MbesFormats();
// Of bytes on a connection, which come in pieces of any size; else of datagrams.
bool IsStream(const std::string& format);

// Bytes of a multibeam sonar, as they come from its socket, to pings and profiles.
class MbesDecoder {
 public:
  // Throws std::invalid_argument for a format that does not exist.
  explicit MbesDecoder(const MbesDecoderParams& params);

  // Returns the pings and sound speed profiles that the payload completes. sender: as in Datagram;
  // parts of different senders are not combined.
  std::vector<MbesOutput> Add(Bytes payload, Time recv, std::uint64_t sender = 0);

  // mbes_datagram_repeated (the same datagram came a moment before), mbes_ping_unstamped, and those
  // of the codec.
  Counters counters() const;
  Counters clock_figures() const { return stamper_.Figures("mbes"); }

 private:
  bool IsRepeat(Bytes payload);
  // Sets the ping's utime; false if there is none (ClockModel).
  bool Stamp(Time recv, MbesPing* ping);

  std::unique_ptr<MbesCodec> codec_;
  bool is_stream_;
  Stamper stamper_;
  std::deque<std::size_t> recent_;  // hashes of the last 64 payloads
  Counters counters_;
};

}  // namespace seastitch
