#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "common/runtime/bus.hpp"
#include "common/runtime/worker.hpp"
#include "mapper/mapper_node.hpp"

namespace seastitch {

// Front end of one dive of several, from sensors to submaps: a mapper with the vehicle and
// navigation of that dive, which registers nothing. Its output goes to the mapper that all dives
// share.
class DiveFront {
 public:
  using GiveSubmap = std::function<void(Submap, Mapper::OfDive)>;
  using GiveNav = std::function<void(const NavState&)>;

  // chain: its number; first_id: of its first submap among those of all dives.
  DiveFront(MapperConfig config,
            std::int32_t chain,
            std::int32_t first_id,
            GiveSubmap give_submap,
            GiveNav give_nav);
  DiveFront(const DiveFront&) = delete;
  DiveFront& operator=(const DiveFront&) = delete;

  // Bus for the messages of the sensors.
  Bus* bus() { return &bus_; }
  MapperNode& mapper() { return mapper_; }
  // Gives what is left.
  void Finish();
  // The id after that of its last submap.
  std::int32_t next_id() const { return next_id_; }

 private:
  struct Closed {
    Submap submap;
    Mapper::OfDive dive;
  };
  void On(const MapperEvent& event);
  void AddEdges(const GraphUpdate& update);
  void GiveClosed();

  const std::int32_t chain_;
  const std::int32_t first_id_;
  std::int32_t next_id_;
  const GiveSubmap give_submap_;
  const GiveNav give_nav_;
  std::optional<Closed> closed_;  // waits for its edges
  Bus bus_{"memq://"};
  InlineWorker worker_;
  MapperNode mapper_;
};

}  // namespace seastitch
