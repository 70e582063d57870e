#include "drivers/can/unit_clock.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace seastitch {
namespace {

// Limits of a step of the count [us]. A larger step means that the unit was restarted.
constexpr std::int32_t kMaxBackwardUs = 10'000'000;
constexpr std::int32_t kMaxForwardUs = 60'000'000;
// Age of the anchor [us] from which it is moved: far below half of the count's range, up to which
// the difference of two counts is unambiguous.
constexpr std::int32_t kAnchorMoveUs = 600'000'000;
constexpr Duration kUtcStep = std::chrono::milliseconds(1);  // ten steps of ECAN's UTC

std::int32_t Difference(std::uint32_t later, std::uint32_t earlier) {
  return static_cast<std::int32_t>(later - earlier);
}

// UTC from the fields of UnitClock, which begin at v. Nothing if they are not a calendar time.
std::optional<Time> UtcOf(const double* v) {
  using Field = UnitClock::Field;
  const auto whole = [v](Field field) { return static_cast<int>(v[field]); };
  const std::chrono::year_month_day date{
      std::chrono::year(whole(Field::kYear)),
      std::chrono::month(static_cast<unsigned>(whole(Field::kMonth))),
      std::chrono::day(static_cast<unsigned>(whole(Field::kDay)))};
  const auto is_within = [v](Field field, double end) { return v[field] >= 0 && v[field] < end; };
  const bool usable = date.ok() && whole(Field::kYear) >= 2000 && whole(Field::kYear) < 2200 &&
                      is_within(Field::kHour, 24) && is_within(Field::kMinute, 60) &&
                      is_within(Field::kSecond, 61) && is_within(Field::kMicrosecond, 1e6);
  if (!usable) return std::nullopt;
  const std::chrono::sys_days days(date);
  return Time(std::chrono::duration_cast<Duration>(days.time_since_epoch()) +
              std::chrono::hours(whole(Field::kHour)) +
              std::chrono::minutes(whole(Field::kMinute)) +
              std::chrono::seconds(whole(Field::kSecond)) + Duration(whole(Field::kMicrosecond)));
}

// True if both are the same part of a second. GPS time and UTC differ by whole seconds: different
// parts of a second belong to different instants.
bool SamePartOfSecond(Time utc, double time_of_week_ms) {
  const std::int64_t gps_us = static_cast<std::int64_t>(time_of_week_ms) * 1000;
  const std::int64_t difference = ((ToUtime(utc) - gps_us) % 1'000'000 + 1'000'000) % 1'000'000;
  return std::min(difference, 1'000'000 - difference) <= 2000;
}

}  // namespace

UnitClock::UnitClock(const SignalMap& signals,
                     std::size_t first_field,
                     const ClockParams& params,
                     double max_burst_s)
    : params_(params),
      first_(first_field),
      max_burst_s_(max_burst_s),
      has_count_(signals.Has(first_field + kTimeUs)),
      stamper_(params) {
  for (std::size_t field = first_; field < first_ + kNumFields; ++field)
    fields_.set(field, signals.Has(field));
  needed_ = fields_;
  needed_.set(first_ + kTimeUs, fields_.any());
}

void UnitClock::Add(const FieldValues& values, Time recv, const std::optional<Reading>& epoch) {
  const std::size_t count = first_ + kTimeUs;
  if (values.present.test(count)) {
    utc_ = FieldValues{};
    utc_recv_ = recv;
    AddCount(CountOf(values.value[count]));
  } else if (!has_count_ && epoch) {
    utc_ = FieldValues{};
    utc_.Set(count, epoch->device_us);
    utc_recv_ = epoch->recv;
  }
  for (std::size_t field = first_; field < first_ + kNumFields; ++field)
    if (values.present.test(field)) utc_.Set(field, values.value[field]);
  const bool opened =
      utc_.present.test(count) && std::abs(ToSeconds(recv - utc_recv_)) <= max_burst_s_;
  if (opened && utc_.present != needed_) return;

  const FieldValues used = std::exchange(utc_, FieldValues{});
  const std::optional<Time> utc = opened ? UtcOf(&used.value[first_]) : std::nullopt;
  const std::size_t of_week = first_ + kTimeOfWeekMs;
  if (!utc || (used.present.test(of_week) && !SamePartOfSecond(*utc, used.value[of_week]))) {
    ++counters_["utc_malformed"];
    return;
  }
  const Anchor anchor{CountOf(used.value[count]), *utc};
  if (anchor_) {
    const Time expected = anchor_->utc + Duration(Difference(anchor.device_us, anchor_->device_us));
    if (std::chrono::abs(anchor.utc - expected) > kUtcStep) ++counters_["utc_stepped"];
  }
  anchor_ = anchor;
}

void UnitClock::AddCount(std::uint32_t device_us) {
  const std::int32_t step = last_device_us_ ? Difference(device_us, *last_device_us_) : 0;
  last_device_us_ = device_us;
  if (step < -kMaxBackwardUs || step > kMaxForwardUs) {
    ++counters_["device_restarted"];
    anchor_.reset();
    return;
  }
  if (!anchor_) return;
  const std::int32_t since_anchor = Difference(device_us, anchor_->device_us);
  if (since_anchor > kAnchorMoveUs)
    anchor_ = Anchor{device_us, anchor_->utc + Duration(since_anchor)};
}

std::optional<Time> UnitClock::Stamp(const Reading& reading) {
  const std::optional<Time> device = DeviceTime(reading);
  return device ? stamper_.Stamp(*device, reading.recv) : std::nullopt;
}

std::optional<Time> UnitClock::DeviceTime(const Reading& reading) {
  if (params_.clock != DeviceClock::kDevice)
    return Time(counter_.Unwrap(reading.device_us, reading.recv));
  if (!anchor_) return std::nullopt;
  return anchor_->utc + Duration(Difference(reading.device_us, anchor_->device_us));
}

}  // namespace seastitch
