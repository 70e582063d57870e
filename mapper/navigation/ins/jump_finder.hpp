#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "common/core/time.hpp"

namespace seastitch {

// Finds the jumps of a given position. Position minus integrated velocity drifts at a constant
// rate, apart from noise. It steps when the INS uses a fix. The medians of 15 positions (or 5 s)
// before and after are compared, relative to the noise of the positions themselves. A single
// position that deviates is a spike. Pure.
//
// A jump that takes some seconds is a slide: an INS that finds in a turn that its heading is wrong
// moves its position by metres. If position and velocity agreed before, the track follows the
// velocity during the slide, and the rest is the jump. If not, the velocity is considered wrong,
// and there is no jump.
//
// Without velocities the motion is estimated from the positions: one velocity in the vehicle's
// axes, which turn with its heading, for all positions of the window. This velocity, and the drift,
// are medians over pairs of positions on the same side of the possible jump.
class JumpFinder {
 public:
  struct Position {
    Time time;
    Eigen::Vector2d given_m = Eigen::Vector2d::Zero();  // north, east
    std::optional<Eigen::Vector2d> v_mps;
    double sigma_m = 0.0;               // 1 sigma by its source; 0: not given
    std::optional<double> heading_rad;  // of the vehicle; used where v_mps is not given

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.given_m, self.v_mps, self.sigma_m, self.heading_rad);
    }
  };
  struct Steady : Position {
    // given_m minus all jumps so far, and minus what the velocity does not explain if it is
    // followed
    Eigen::Vector2d steady_m = Eigen::Vector2d::Zero();
    bool jumped =
        false;  // between the previous position and this one, or by a slide that ends here
    double jump_variance_m2 = 0.0;  // variance of the jump, each axis
  };

  // min_jump_m: smaller steps are not jumps. follow_velocity: the track follows the velocity, where
  // there is one, between jumps as well; else the position.
  JumpFinder(double min_jump_m, bool follow_velocity)
      : min_jump_m_(min_jump_m), follow_velocity_(follow_velocity) {}

  // Times must increase.
  void Add(const Position& position);
  // Returns the decided positions in order. now: no position before it will come.
  std::vector<Steady> Take(Time now);
  // Call it after the last position.
  std::vector<Steady> Finish();

  bool empty() const { return waiting_.empty(); }
  // The positions that are not decided yet, in order.
  std::vector<Position> Waiting() const;
  int spikes() const { return spikes_; }

  // For a restart. Not saved: min_jump_m_ and follow_velocity_, which are configured; spikes_, of
  // one process.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(self.waiting_, self.last_, self.before_, self.steps_m_, self.jumps_m_);
    archive(self.shifts_m_, self.slide_m_);
  }

 private:
  struct Entry {
    Position position;
    Eigen::Vector2d residual_m;  // given position minus integrated velocity
    Eigen::Vector2d ahead_m;     // position of a vehicle that moves at 1 m/s along the heading
    bool by_velocity = false;    // residual_m continues that of the previous position

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.position, self.residual_m, self.ahead_m, self.by_velocity);
    }
  };
  // Positions around the first one that waits, which is after_m[0].
  struct Window {
    std::vector<Eigen::Vector2d> before_m, after_m;  // positions minus the motion
    double min_jump_m;                               // nothing smaller is a jump
    double variance;  // variance of the jump divided by that of a position
  };

  void DecideFirst(std::vector<Steady>* out);
  Window Around() const;
  std::optional<Eigen::Vector2d> JumpIn(const Window& window, double noise_m) const;
  bool Slides(double noise_m, const Entry& first);
  bool IsSpike(const Window& window, double noise_m) const;
  double Noise(const Window& window) const;

  double min_jump_m_;
  bool follow_velocity_;
  std::deque<Entry> waiting_;    // not decided
  std::optional<Entry> last_;    // the last one added
  std::deque<Entry> before_;     // decided, since the last jump or gap
  std::deque<double> steps_m_;   // of the residual from one position to the next, both axes
  std::deque<double> shifts_m_;  // of the residual, from the positions before to those after
  Eigen::Vector2d jumps_m_ = Eigen::Vector2d::Zero();  // given_m minus steady_m
  Eigen::Vector2d slide_m_ = Eigen::Vector2d::Zero();  // since the slide began; 0: none
  int spikes_ = 0;
};

}  // namespace seastitch
