#pragma once

#include "common/core/grid.hpp"
#include "mapper/registration/registration.hpp"

namespace seastitch {

// How noisy soundings are from place to place: the outer beams of a swath scatter several times as
// much as those below the vehicle. With one noise for a whole submap its rims, which are the
// noisiest part of every overlap, drew neighbouring lines together by centimetres that add up over
// a survey. Relief finer than the cells counts as noise, within bounds.
class LocalNoise {
 public:
  // From the scatter of the soundings in the cells of the finest level, where least of it is
  // relief. Nothing is believed to be below least_sigma_m.
  LocalNoise(const RegistrationSubmap::Level& finest, double least_sigma_m);

  // Makes what the cells of a level know of their errors, which must be of unit noise, that of the
  // noise where they are; sets Cell::noise.
  void Weigh(RegistrationSubmap::Level* level) const;

 private:
  // Of some cells of the finest level.
  struct Block {
    float variance = 0.0f;                               // of soundings; 0: nothing known near
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
  float typical_ = 0.0f;  // 0: nothing is known
};

}  // namespace seastitch
