#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// Every sounding of one submap, in its frame: what the submap's cloud was made of, and what was
// left out of it.
struct SubmapSoundings {
  struct Ping {
    Time time;
    std::uint32_t number = 0;  // the sonar's counter
    std::uint8_t head = 0;
  };
  struct Sounding {
    Eigen::Vector3f p_submap_m = Eigen::Vector3f::Zero();
    std::uint32_t ping = 0;  // its place in `pings`
    std::uint16_t beam = 0;  // from 0
    bool used = false;       // it is behind a point of the cloud
  };

  SubmapId id;
  std::vector<Ping> pings;
  std::vector<Sounding> soundings;
};

}  // namespace seastitch
