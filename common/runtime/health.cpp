#include "common/runtime/health.hpp"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <utility>

#include "common/core/channel_names.hpp"
#include "common/core/utf8.hpp"
#include "common/runtime/process/restart_counter.hpp"

namespace seastitch {
namespace {

// Longest delay of the message about a change of state.
constexpr std::chrono::milliseconds kTimerPeriod(100);
constexpr double kTimerPeriodS = 0.1;
// Shortest time between regular messages: below 1 s, because the timer's period is not exact.
constexpr double kSecond = 0.95;
constexpr std::size_t kMaxDetail = 300;
constexpr std::size_t kMaxText = 2000;  // HEALTH has to fit into one datagram

const char* ToString(HealthState state) {
  switch (state) {
    case HealthState::kStarting: return "starting";
    case HealthState::kOk: return "ok";
    case HealthState::kDegraded: return "degraded";
    case HealthState::kLost: return "lost";
  }
  return "unknown";
}

// A file name or an error text as one line of limited length, not cut inside a UTF-8 character.
std::string OneLine(std::string text, std::size_t max_size) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  if (text.size() <= max_size) return text;
  return text.substr(0, WholeCharacters(text, max_size)) + "...";
}

void Append(const std::string& part, std::string* line) {
  if (part.empty()) return;
  if (!line->empty()) *line += "; ";
  *line += part;
}

}  // namespace

double MonotonicSeconds() {
  timespec since_boot{};
  clock_gettime(CLOCK_BOOTTIME, &since_boot);
  return static_cast<double>(since_boot.tv_sec) + 1e-9 * static_cast<double>(since_boot.tv_nsec);
}

std::int64_t NowUtime() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_epoch).count();
}

Health::Health(std::string process, Clock clock)
    : process_(std::move(process)),
      clock_(std::move(clock)),
      start_s_(clock_()),
      state_since_s_(start_s_) {}

bool Health::Record::holds() const {
  return std::any_of(details.begin(), details.end(), [](const auto& d) { return d.has_value(); });
}

std::string Health::Record::Sentence() const {
  std::string all;
  for (const std::optional<std::string>& detail : details) {
    if (!detail || detail->empty()) continue;
    if (!all.empty()) all += ", ";
    all += *detail;
  }
  return all.empty() ? kind->sentence : kind->sentence + (": " + all);
}

void Health::Hold(const ConditionKind& kind, std::string detail) {
  SetDetail(kByNode, kind, std::move(detail));
  NoteState();
}

void Health::Release(const ConditionKind& kind) {
  SetDetail(kByNode, kind, std::nullopt);
  NoteState();
}

void Health::HoldIf(bool holds, const ConditionKind& kind, std::string detail) {
  if (holds)
    Hold(kind, std::move(detail));
  else
    Release(kind);
}

void Health::FollowEvents(const ConditionKind& kind,
                          std::int64_t total,
                          double now_s,
                          std::string detail) {
  FaultEvents<double>& events = events_.try_emplace(kind.name, kind).first->second;
  events.Follow(total, now_s);
  HoldIf(events.Holds(now_s), kind, std::move(detail));
}

void Health::SetDetail(Finder finder,
                       const ConditionKind& kind,
                       std::optional<std::string> detail) {
  if (!detail && !records_.contains(kind.name)) return;
  Record& record = records_[kind.name];
  record.kind = &kind;
  const bool held = record.holds();
  if (detail) detail = OneLine(*std::move(detail), kMaxDetail);
  record.details[finder] = std::move(detail);
  if (held || !record.holds()) return;
  record.since_s = clock_();
  ++record.count;
}

void Health::SetFound(Finder finder, const std::vector<Condition>& found) {
  std::map<std::string_view, Condition> by_name;
  for (const Condition& condition : found) {
    const auto [place, first] = by_name.try_emplace(condition.kind->name, condition);
    if (!first && !condition.detail.empty()) place->second.detail += ", " + condition.detail;
  }
  for (const auto& [name, record] : records_)
    if (!by_name.contains(name)) SetDetail(finder, *record.kind, std::nullopt);
  for (auto& [name, condition] : by_name)
    SetDetail(finder, *condition.kind, std::move(condition.detail));
  NoteState();
}

void Health::SetStarting(std::string waits_for) {
  starting_ = OneLine(std::move(waits_for), kMaxDetail);
  NoteState();
}

void Health::SetRunning() {
  starting_.reset();
  NoteState();
}

void Health::SetText(std::string figures) { figures_ = OneLine(std::move(figures), kMaxText); }

std::vector<const Health::Record*> Health::Holding() const {
  std::vector<const Record*> holding;
  for (const auto& [name, record] : records_)
    if (record.holds()) holding.push_back(&record);
  std::stable_sort(holding.begin(), holding.end(), [](const Record* a, const Record* b) {
    return a->kind->severity > b->kind->severity;
  });
  return holding;
}

void Health::NoteState() {
  const std::vector<const Record*> holding = Holding();
  HealthState state = starting_ ? HealthState::kStarting : HealthState::kOk;
  if (!holding.empty()) state = static_cast<HealthState>(holding.front()->kind->severity);
  if (state == state_) return;
  state_ = state;
  state_since_s_ = clock_();
}

std::string Health::text() const {
  std::string line;
  for (const Record* record : Holding()) Append(record->Sentence(), &line);
  Append(starting_ ? *starting_ : core_ ? core_->text() : figures_, &line);
  return line.empty() ? ToString(state_) : OneLine(std::move(line), kMaxText);
}

std::map<std::string, std::int64_t> Health::Counters() const {
  if (!core_) return counters_;
  std::map<std::string, std::int64_t> all = core_->counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

std::int64_t Health::counter(const std::string& name) const {
  const auto own = counters_.find(name);
  if (own != counters_.end()) return own->second;
  const std::map<std::string, std::int64_t> all = Counters();
  const auto found = all.find(name);
  return found == all.end() ? 0 : found->second;
}

health_t Health::Snapshot(std::int64_t now_utime, double period_s) {
  EndRatePeriod(period_s);
  health_t msg = Message(now_utime);
  ++seq_;
  return msg;
}

void Health::EndRatePeriod(double period_s) {
  for (auto& [name, ticks] : ticks_) {
    rates_hz_[name] = period_s > 0.0 ? static_cast<double>(ticks) / period_s : 0.0;
    ticks = 0;  // a stream that stops remains in the list, with 0 Hz
  }
}

health_t Health::Message(std::int64_t now_utime) const {
  const double now_s = clock_();
  // From the monotonic clock: the system clock may have been set since.
  const auto utime_of = [&](double time_s) {
    return now_utime - static_cast<std::int64_t>(1e6 * (now_s - time_s));
  };
  health_t msg{};
  msg.utime = now_utime;
  msg.seq = seq_;
  msg.process = process_;
  msg.version = SEASTITCH_VERSION;
  msg.uptime_s = now_s - start_s_;
  msg.restarts = restarts_;
  msg.state = static_cast<std::int8_t>(state_);
  msg.state_since_utime = utime_of(state_since_s_);
  msg.text = text();
  for (const Record* record : Holding()) {
    condition_t condition{};
    condition.name = record->kind->name;
    condition.severity = static_cast<std::int8_t>(record->kind->severity);
    condition.sentence = record->Sentence();
    condition.since_utime = utime_of(record->since_s);
    condition.count = record->count;
    msg.conditions.push_back(std::move(condition));
  }
  for (const auto& [name, value] : Counters()) {
    counter_t counter{};
    counter.name = name;
    counter.value = value;
    msg.counters.push_back(std::move(counter));
  }
  for (const auto& [name, hz] : rates_hz_) {
    msg.rate_names.push_back(name);
    msg.rate_hz.push_back(hz);
  }
  msg.num_conditions = static_cast<std::int32_t>(msg.conditions.size());
  msg.num_counters = static_cast<std::int32_t>(msg.counters.size());
  msg.num_rates = static_cast<std::int32_t>(msg.rate_hz.size());
  return msg;
}

void Health::WatchAge(const std::string& name,
                      const ConditionKind& kind,
                      double limit_s,
                      std::function<double()> age_s) {
  self_watch_.AddAge({name, &kind, limit_s, std::move(age_s)});
}

void Health::PublishEverySecond(Bus* bus, EventLoop* loop) {
  if (const char* directory = std::getenv("RUNTIME_DIRECTORY"); directory != nullptr)
    restarts_ = CountRestart(directory);
  last_timer_s_ = last_second_s_ = clock_();
  loop->Every(kTimerPeriod, [this, bus] { OnTimer(bus); });
}

void Health::ReportProgress() { sd_notify(0, "WATCHDOG=1"); }

void Health::OnTimer(Bus* bus) {
  const double now_s = clock_();
  late_s_ = std::max(late_s_, now_s - last_timer_s_ - kTimerPeriodS);
  last_timer_s_ = now_s;
  if (now_s - last_second_s_ < kSecond) {
    if (state_ != sent_state_) Publish(bus);
    return;
  }
  const SelfWatch::Report report = self_watch_.Check(*bus, now_s, late_s_);
  for (const auto& [name, value] : report.counters) Set(name, value);
  SetFound(kBySelfWatch, report.conditions);
  EndRatePeriod(now_s - last_second_s_);
  last_second_s_ = now_s;
  late_s_ = 0.0;
  Publish(bus);
  sd_notifyf(0, "WATCHDOG=1\nSTATUS=%s: %s", ToString(state_), text().c_str());
}

void Health::Publish(Bus* bus) {
  if (state_ != sent_state_) {
    const bool bad = state_ == HealthState::kDegraded || state_ == HealthState::kLost;
    spdlog::log(bad ? spdlog::level::warn : spdlog::level::info,
                "{} -> {}: {}",
                ToString(sent_state_),
                ToString(state_),
                text());
    sent_state_ = state_;
  }
  bus->Publish(channels::kHealth, Message(NowUtime()));
  ++seq_;
}

std::optional<std::int64_t> ValueIn(const health_t& health,
                                    HealthValue which,
                                    const std::string& device) {
  const std::string name = (device.empty() ? "" : device + "_") + NameOf(which);
  for (const counter_t& counter : health.counters)
    if (counter.name == name) return counter.value;
  return std::nullopt;
}

}  // namespace seastitch
