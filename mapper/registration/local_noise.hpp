#pragma once

#include "common/core/grid.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// Noise of soundings as a function of place. The outer beams of a swath scatter several times as
// much as those below the vehicle. With one noise for a whole submap, its rims, the noisiest part
// of every overlap, would draw neighbouring lines together by centimetres, which add up over a
// survey. Relief finer than the cells counts as noise, within bounds.
class LocalNoise {
 public:
  // Estimates the noise from the scatter of the soundings in the cells of the finest level, which
  // has the least relief in it. Lower bound: least_sigma_m.
  LocalNoise(const RegistrationSubmap::Level& finest, double least_sigma_m);

  // Scales the variances and covariances of the cells of a level from unit noise to the noise at
  // each cell, and sets Cell::noise.
  void Weigh(RegistrationSubmap::Level* level) const;

 private:
  // Of some cells of the finest level.
  struct Block {
    float variance = 0.0f;                               // of soundings; 0: unknown
    Eigen::Vector2f middle = Eigen::Vector2f::Zero();    // of those cells, from the grid's origin
    Eigen::Vector2f gradient = Eigen::Vector2f::Zero();  // of its logarithm, a metre
  };
  struct Noise {
    float ratio = 1.0f;                                  // to that of the typical block
    Eigen::Vector2f gradient = Eigen::Vector2f::Zero();  // of the ratio, a metre
  };

  static Grid<Block> BlocksOf(const RegistrationSubmap::Level& finest, double least_sigma_m);
  Eigen::Vector2f GradientAt(int row, int col) const;
  Block NearestTo(int row, int col) const;
  // p: from the grid's origin.
  Noise At(const Block& block, const Eigen::Vector2f& p) const;

  Grid<Block> blocks_;
  float typical_ = 0.0f;  // 0: unknown
};

}  // namespace seastitch
