#include "mapper/navigation/aiding/inertial_history.hpp"

#include <algorithm>
#include <iterator>

#include "common/core/time_series.hpp"

namespace seastitch {

void InertialHistory::Add(Time t, const InertialRates& from, const InertialRates& to, double dt_s) {
  const Moment before = empty() ? Moment{} : moments_.back();
  const Eigen::Vector3d turn = 0.5 * dt_s * (from.angular_rate_radps + to.angular_rate_radps);
  const Eigen::Vector3d push = 0.5 * dt_s * (from.specific_force_mps2 + to.specific_force_mps2);
  const Eigen::Quaterniond halfway = before.turn * QuaternionFromRotationVector(0.5 * turn);
  Moment now;
  now.time = t;
  now.turn = (before.turn * QuaternionFromRotationVector(turn)).normalized();
  now.push_mps = before.push_mps + halfway * push;
  now.rate_radps = to.angular_rate_radps;
  moments_.push_back(now);
  while (ToSeconds(t - moments_.front().time) > span_s_) moments_.pop_front();
}

InertialHistory::Moment InertialHistory::At(Time t) const {
  const auto after = FirstFrom(moments_, t);
  if (after == moments_.begin()) return moments_.front();
  if (after == moments_.end()) return moments_.back();
  const auto before = std::prev(after);
  const double w = ToSeconds(t - before->time) / ToSeconds(after->time - before->time);
  Moment at;
  at.time = t;
  at.turn = before->turn.slerp(w, after->turn);
  at.push_mps = (1.0 - w) * before->push_mps + w * after->push_mps;
  at.rate_radps = (1.0 - w) * before->rate_radps + w * after->rate_radps;
  return at;
}

}  // namespace seastitch
