#include "survey/read/log_source.hpp"

#include <utility>

namespace seastitch {
namespace {

bool IsOfRole(const LogEvent& event, ChannelRole role) {
  const Channel* channel = FindChannel(event.channel);
  return channel != nullptr && channel->role == role;
}

}  // namespace

LogSource::LogSource(const RecordedLogs& recorded, std::unique_ptr<RawReplay> raw, bool quiet)
    : first_log_(recorded.recorders[0][0].path),
      logs_(recorded, raw ? EventLogReader::Wanted() : WithoutRawBytes, quiet),
      raw_(std::move(raw)) {}

std::optional<Received> LogSource::Next() {
  while (true) {
    if (raw_)
      if (auto sample = raw_->Take()) return sample;
    const std::optional<LogEvent> event = ended_ ? std::nullopt : logs_.Next();
    if (event) {
      if (auto sample = Use(*event)) return sample;
    } else if (!std::exchange(ended_, true) && raw_) {
      raw_->Finish();
    } else {
      if (any_) return std::nullopt;
      throw DataError(first_log_.string() + ": no event on a channel that a replay reads");
    }
  }
}

std::optional<Received> LogSource::Use(const LogEvent& event) {
  const bool is_raw = raw_ && IsOfRole(event, ChannelRole::kRaw);
  // HEALTH gives the mapper the time that passes while sensors are silent.
  const bool is_health = event.channel == channels::kHealth;
  if (!is_raw && !is_health && !IsOfRole(event, ChannelRole::kSensor)) return std::nullopt;
  any_ = any_ || !is_health;
  now_s_ = 1e-6 * static_cast<double>(event.utime);
  if ((raw_ && raw_->MakesAnew(event.channel)) || !types_.Add(event)) return std::nullopt;
  if (!is_raw) return inbox_.Take(event.channel, event.data, now_s_);
  raw_->Add(event);
  return std::nullopt;
}

std::vector<Condition> LogSource::conditions() const {
  std::vector<Condition> faults = inbox_.Faults(now_s_);
  if (raw_)
    for (Condition& fault : raw_->Faults()) faults.push_back(std::move(fault));
  return faults;
}

Counters LogSource::refused() const {
  Counters refused = logs_.refused();
  if (raw_) refused.merge(raw_->counters());
  for (const auto& [channel, events] : types_.Foreign())
    refused["of_another_type_" + channel] = events;
  return refused;
}

}  // namespace seastitch
