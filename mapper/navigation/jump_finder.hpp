#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/time.hpp"

namespace seastitch {

// Tells the jumps of a given position from the motion: position less integrated velocity is level
// but for noise, and steps where the INS has taken a fix. The medians of 15 positions (or 5 s)
// before and after are compared, by the noise that the positions themselves show. A position that
// stands alone is a spike. Without velocities nothing is looked for. Pure.
class JumpFinder {
 public:
  struct Position {
    Time time;
    Eigen::Vector2d given_m = Eigen::Vector2d::Zero();  // north, east
    std::optional<Eigen::Vector2d> v_mps;
    double sigma_m = 0.0;  // 1 sigma by its source; 0: not given

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.given_m, self.v_mps, self.sigma_m);
    }
  };
  struct Steady : Position {
    Eigen::Vector2d steady_m = Eigen::Vector2d::Zero();  // given_m less all jumps so far
    bool jumped = false;                                 // between the position before and this
    double jump_variance_m2 = 0.0;                       // each axis: how well that jump is known
  };

  // min_jump_m: nothing smaller is called a jump.
  explicit JumpFinder(double min_jump_m) : min_jump_m_(min_jump_m) {}

  // Of rising time.
  void Add(const Position& position);
  // The positions that are decided, in order. now: no position before it will come.
  std::vector<Steady> Take(Time now);
  // No more positions come.
  std::vector<Steady> Finish();

  bool empty() const { return waiting_.empty(); }
  int spikes() const { return spikes_; }

  // For a restart. Not saved: min_jump_m_, which is configured; spikes_, of one process.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.waiting_, self.last_, self.before_, self.steps_m_, self.jumps_m_);
  }

 private:
  struct Entry {
    Position position;
    Eigen::Vector2d residual_m;  // given, less integrated velocity

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.position, self.residual_m);
    }
  };
  using Residuals = std::vector<Eigen::Vector2d>;

  void DecideFirst(std::vector<Steady>* out);
  std::optional<Eigen::Vector2d> JumpBefore(const Residuals& after, double noise_m) const;
  bool IsSpike(const Residuals& after, double noise_m) const;
  double Threshold(std::size_t after, double noise_m) const;
  double Noise() const;

  double min_jump_m_;
  std::deque<Entry> waiting_;   // not decided
  std::optional<Entry> last_;   // added last
  std::deque<Entry> before_;    // decided, since the last jump or gap
  std::deque<double> steps_m_;  // of the residual from one position to the next, both axes
  Eigen::Vector2d jumps_m_ = Eigen::Vector2d::Zero();
  int spikes_ = 0;
};

}  // namespace seastitch
