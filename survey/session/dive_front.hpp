#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "survey/session/local_mapper.hpp"

namespace seastitch {

// Covariance of x, y [m], yaw [rad] of the submap that a dive starts with, from its start edge.
// Absent where its place is not known.
std::optional<Eigen::Matrix3d> StartCovariance(const GraphEdge& start, double heading_sigma_rad);

// Processing of one dive when several dives are mapped together: dead reckoning, georeferencing and
// building of submaps, with the vehicle configuration of that dive, and without registration.
// Closed submaps go to the mapper that all dives share, which registers them.
class DiveFront {
 public:
  // Callbacks: for each closed submap, with its dead-reckoning edges; for each NavState.
  using GiveSubmap = std::function<void(Submap, Mapper::OfDive)>;
  using GiveNav = std::function<void(const NavState&)>;

  // chain: number of the dive. first_id: id of its first submap; ids are unique among all dives.
  DiveFront(MapperConfig config,
            std::int32_t chain,
            std::int32_t first_id,
            GiveSubmap give_submap,
            GiveNav give_nav);
  DiveFront(const DiveFront&) = delete;
  DiveFront& operator=(const DiveFront&) = delete;

  void Add(const Received& received) { mapper_.Add(received); }
  LocalMapper& mapper() { return mapper_; }
  // Closes the last submap and passes it on.
  void Finish();
  // First id for the next dive; valid after Finish().
  std::int32_t next_id() const { return next_id_; }

 private:
  struct Closed {
    Submap submap;
    Mapper::OfDive dive;
  };
  void On(const MapperEvent& event);
  void Take(const GraphUpdate& update);
  void GiveFirst();

  const Chain chain_;  // without a start
  const std::int32_t first_id_;
  std::int32_t next_id_;
  const GiveSubmap give_submap_;
  const GiveNav give_nav_;
  std::deque<Closed> closed_;  // their edges come in later events
  LocalMapper mapper_;
};

}  // namespace seastitch
