#include "survey/read/log_figures.hpp"

#include <algorithm>
#include <optional>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

constexpr std::int64_t kSilentUs = 5'000'000;
constexpr std::size_t kMostSteps = 1'000;  // limit, for damaged logs

std::int64_t Difference(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return b < 0 ? INT64_MAX : INT64_MIN;
}

std::int64_t Sum(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b < 0 ? INT64_MIN : INT64_MAX;
}

}  // namespace

double SenderFigures::rate_hz() const {
  const double span_s = static_cast<double>(Difference(last_utime, first_utime)) * 1e-6;
  return span_s > 0.0 ? static_cast<double>(events - 1) / span_s : 0.0;
}

void SenderFigures::Add(const SenderFigures& other) {
  first_utime = events == 0 ? other.first_utime : std::min(first_utime, other.first_utime);
  last_utime = events == 0 ? other.last_utime : std::max(last_utime, other.last_utime);
  events += other.events;
  bytes += other.bytes;
  longest_gap_us = std::max(longest_gap_us, other.longest_gap_us);
  clock_steps_back += other.clock_steps_back;
  lost = Sum(lost, other.lost);
  undecodable += other.undecodable;
}

SenderFigures Total(const LogFigures::Senders& senders) {
  SenderFigures total;
  for (const auto& [sender, figures] : senders) total.Add(figures);
  return total;
}

void LogFigures::Add(const LogEvent& event) {
  NoteClock(event);
  const Channel* channel = FindChannel(event.channel);
  const bool decodes = channel != nullptr && channel->decodes(event.data);
  const std::optional<MessagePlace> place = decodes ? PlaceOf(event.data) : std::nullopt;
  const std::string sender = place ? place->sender : "";
  SenderFigures& figures = channels_[event.channel][sender];
  if (figures.events == 0) {
    figures.first_utime = event.utime;
  } else {
    const std::int64_t gap = Difference(event.utime, figures.last_utime);
    figures.longest_gap_us = std::max(figures.longest_gap_us, gap);
    if (gap < 0) ++figures.clock_steps_back;
  }
  figures.last_utime = event.utime;
  figures.bytes += static_cast<std::int64_t>(event.data.size());
  if (channel != nullptr && !decodes) ++figures.undecodable;
  ++figures.events;
  if (!place) return;
  const auto [watch, is_new] = watches_.try_emplace(event.channel + '\0' + sender);
  const std::int64_t lost = watch->second.Add(place->seq);
  figures.lost = Sum(figures.lost, lost);
  if (is_new || jump_.step_us == 0) return;
  if (lost == 0 && clock_steps_.size() < kMostSteps) clock_steps_.push_back(jump_);
  jump_.step_us = 0;
}

void LogFigures::NoteClock(const LogEvent& event) {
  if (events_++ == 0) first_utime_ = last_utime_ = event.utime;
  const std::int64_t step_us = Difference(event.utime, last_utime_);
  if (step_us < 0 && clock_steps_.size() < kMostSteps)
    clock_steps_.push_back({last_utime_, step_us});
  if (step_us > kSilentUs) jump_ = {last_utime_, step_us};
  last_utime_ = event.utime;
}

}  // namespace seastitch
