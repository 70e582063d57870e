#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/core/ids.hpp"
#include "common/core/time.hpp"

namespace seastitch {

// All soundings of one submap, in its frame [m]: those that its cloud was made of, and those that
// filters left out.
struct SubmapSoundings {
  struct Ping {
    Time time;
    std::uint32_t number = 0;  // the sonar's counter
    std::uint8_t head = 0;
  };
  // The vehicle at the time of a ping, in the submap's level frame.
  struct Motion {
    Eigen::Vector3d p_level_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();
  };
  struct Sounding {
    Eigen::Vector3f p_submap_m = Eigen::Vector3f::Zero();
    std::uint32_t ping = 0;  // index into `pings`
    std::uint16_t beam = 0;  // from 0
    bool used = false;       // a point of the cloud contains it
  };

  SubmapId id;
  Eigen::Matrix3d R_level_submap = Eigen::Matrix3d::Identity();
  std::vector<Ping> pings;
  std::vector<Motion> motions;  // of each ping
  std::vector<Sounding> soundings;
};

}  // namespace seastitch
