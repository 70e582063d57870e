#pragma once

#include <cstdint>
#include <deque>

#include "common/convert/convert.hpp"
#include "common/runtime/bus.hpp"
#include "mapper/loops/graph_log.hpp"

namespace seastitch {

// Sends the graph and the submaps: SUBMAP, SUBMAP_POINTS and GRAPH_UPDATE. Points, and updates that
// were requested again, go one by one: all at once, a megabyte, would overflow the receivers'
// buffers.
class GraphPublisher {
 public:
  GraphPublisher(const GraphLog* graph, Bus* bus) : graph_(graph), bus_(bus) {}

  // Sends the submap; its points wait.
  void Announce(const Submap& submap);
  // Versions up to this one may be sent: they are on the disk.
  void Allow(std::int64_t version) { version_allowed_ = version; }
  // A new version. It is sent at once where it may be, behind those that were requested again.
  void AddNew();
  void SendNew();

  // The first sends one chunk of points, the second one update, if any waits. False: none did.
  bool SendNextChunk();
  bool SendNextUpdate();

  // A receiver has the versions up to this one: some of the others at once, the rest one by one.
  void SendAfter(std::int64_t have_version);
  // After a restart: the newest version may not have been sent.
  void Resume();
  // True if the newest version was there at the last call, and has been sent.
  bool IsNewestOld();
  // Sends the newest version once more. False: it may not be sent.
  bool SendNewestAgain();

 private:
  const GraphLog* const graph_;
  Bus* const bus_;
  std::deque<submap_points_t> chunks_;  // waiting to be sent
  std::int64_t version_sent_ = 0;       // newest version sent
  std::int64_t version_looked_at_ = 0;  // newest version at the last IsNewestOld()
  std::int64_t version_allowed_ = 0;    // newest version that may be sent
  int new_ = 0;                         // versions to send that were not requested again
  std::int64_t submap_seq_ = 0;
  std::int64_t points_seq_ = 0;
  std::int64_t update_seq_ = 0;
};

}  // namespace seastitch
