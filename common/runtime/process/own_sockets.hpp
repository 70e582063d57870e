#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace seastitch {

struct SocketFigures {
  std::int64_t drops = 0;         // datagrams that the kernel dropped since the process started
  std::int64_t buffer_bytes = 0;  // receive buffer granted; the smallest where several share a name
};

// The UDP and CAN sockets of this process, LCM's among them, found by its open descriptors. The
// count of drops is that of /proc/net/udp, read from each socket itself (SO_MEMINFO): exact, also
// where nothing is received any more, and where a sequence number cannot show the loss.
class OwnSockets {
 public:
  // State by name: "udp_7667" for the local port, "can". Drops of a closed socket stay counted, as
  // of the last call before.
  const std::map<std::string, SocketFigures>& Read();

 private:
  std::map<std::uint64_t, std::uint32_t> drops_;  // of each socket open now, by inode
  std::map<std::string, SocketFigures> figures_;
};

}  // namespace seastitch
