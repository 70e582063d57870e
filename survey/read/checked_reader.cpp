#include "survey/read/checked_reader.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

#include "survey/read/sbet_beside.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

constexpr double kNearS = 60.0;
constexpr double kLongestPauseS = 43'200.0;  // beside a few records
constexpr std::size_t kFew = 20;

constexpr double kJumpS = 5.0;
constexpr double kLongJumpS = 10.0;

bool HasJumped(Time from, Time to) { return std::abs(ToSeconds(to - from)) > kJumpS; }

bool IsNear(Time a, Time b) { return std::abs(ToSeconds(a - b)) <= kNearS; }

// Profiles, installations and settings may have the time at which they were made. Lines of text
// navigation may be hours apart.
bool HasTimeOfFile(const SurveyRecord& record) {
  const auto* const n = std::get_if<NavigationRecord>(&record);
  return n != nullptr ? !IsExternal(n->source) : IsPing(record);
}

}  // namespace

// --- stamps --------------------------------------------------------------------------------------

void StampCheck::Append(SurveyRecord record, Run* run) {
  const Time t = TimeOf(record);
  if (run->records++ == 0) run->first = t;
  run->last = t;
  run->held.push_back(std::move(record));
}

void StampCheck::Release(Run* run, std::vector<SurveyRecord>* out) {
  std::move(run->held.begin(), run->held.end(), std::back_inserter(*out));
  run->held.clear();
}

void StampCheck::LeaveOut(const SurveyRecord& record) {
  ++left_out_;
  if (IsPing(record)) ++pings_left_out_;
}

void StampCheck::Add(SurveyRecord record, std::vector<SurveyRecord>* out) {
  const Time t = TimeOf(record);
  const auto found = std::find_if(
      runs_.rbegin(), runs_.rend(), [t](const Run& run) { return IsNear(t, run.last); });
  if (found == runs_.rend()) {
    if (runs_.size() == kMostRuns) {  // sparse records show nothing
      for (Run& run : runs_) Release(&run, out);
      runs_.erase(runs_.begin(), runs_.end() - 1);
    }
    runs_.emplace_back();
  } else if (found != runs_.rbegin()) {
    std::size_t between = 0;
    for (auto run = runs_.rbegin(); run != found; ++run) between += run->records;
    if (between > found->records) {
      LeaveOut(*found);
      LeaveOut(record);
      runs_.erase(std::next(found).base());
      return;
    }
    std::for_each(runs_.rbegin(), found, [this](const Run& run) { LeaveOut(run); });
    runs_.erase(found.base(), runs_.end());
  }
  Append(std::move(record), &runs_.back());
  if (runs_.back().records >= kSure) Settle(runs_.size() - 1, out);
}

// True if a run may be another part of the same file.
bool StampCheck::IsBeside(const Run& run, const Run& sure) const {
  const bool before = &run < &sure;
  const double pause_s = ToSeconds(before ? sure.first - run.last : run.first - sure.last);
  return pause_s >= 0.0 && (pause_s < kLongestPauseS || run.records > kFew);
}

// Releases a run and those beside it. The others are left out.
void StampCheck::Settle(std::size_t sure, std::vector<SurveyRecord>* out) {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (i == sure || IsBeside(runs_[i], runs_[sure]))
      Release(&runs_[i], out);
    else
      LeaveOut(runs_[i]);
  }
  runs_.erase(runs_.begin(), runs_.begin() + static_cast<std::ptrdiff_t>(sure));
  runs_.resize(1);
}

void StampCheck::Finish(std::vector<SurveyRecord>* out) {
  if (runs_.empty()) return;
  const auto longest = std::max_element(
      runs_.begin(), runs_.end(), [](const Run& a, const Run& b) { return a.records < b.records; });
  std::size_t all = 0;
  for (const Run& run : runs_) all += run.records;
  // Sparse records show nothing.
  if (2 * longest->records > all)
    Settle(static_cast<std::size_t>(longest - runs_.begin()), out);
  else
    for (Run& run : runs_) Release(&run, out);
  runs_.clear();
}

void PingJumpCheck::Add(SurveyRecord record, std::vector<SurveyRecord>* out) {
  if (!IsPing(record)) {
    out->push_back(std::move(record));
    return;
  }
  const Time t = TimeOf(record);
  if (!held_.empty() && HasComeBack(t)) {
    left_out_ += static_cast<std::int64_t>(held_.size());
    held_.clear();
  }
  const bool goes_on = held_.empty() || !HasJumped(TimeOf(held_.back()), t);
  if (!goes_on || (!held_.empty() && std::abs(ToSeconds(t - TimeOf(held_.front()))) > kLongJumpS))
    Finish(out);
  if (!held_.empty() || (last_ && HasJumped(*last_, t))) {
    held_.push_back(std::move(record));
    return;
  }
  last_ = t;
  out->push_back(std::move(record));
}

// To between the last ping given and those held ahead of it; or to after it, from those held behind
// it.
bool PingJumpCheck::HasComeBack(Time t) const {
  const Time held = TimeOf(held_.front());
  return t >= *last_ && (held < *last_ || t < held);
}

void PingJumpCheck::Finish(std::vector<SurveyRecord>* out) {
  if (held_.empty()) return;
  last_ = TimeOf(held_.back());
  std::move(held_.begin(), held_.end(), std::back_inserter(*out));
  held_.clear();
}

// --- reader --------------------------------------------------------------------------------------

std::vector<SurveyRecord> CheckedReader::Checked(std::vector<SurveyRecord> records) {
  std::vector<SurveyRecord> checked;
  checked.reserve(records.size());
  for (SurveyRecord& record : records) {
    auto* const n = std::get_if<NavigationRecord>(&record);
    if (n != nullptr)
      if (const auto off = clock_offsets_s_.find(n->source); off != clock_offsets_s_.end())
        n->time -= FromSeconds(off->second);
    if (n != nullptr && n->position && n->position->latitude_rad == 0.0 &&
        n->position->longitude_rad == 0.0) {
      n->position.reset();
      ++at_zero_;
    }
    if (HasTimeOfFile(record))
      stamps_.Add(std::move(record), &checked);
    else
      checked.push_back(std::move(record));
  }
  return checked;
}

std::vector<SurveyRecord> CheckedReader::Add(Bytes bytes) {
  std::vector<SurveyRecord> records;
  for (SurveyRecord& record : Checked(reader_->Add(bytes))) jumps_.Add(std::move(record), &records);
  return records;
}

std::vector<SurveyRecord> CheckedReader::Finish() {
  std::vector<SurveyRecord> checked = Checked(reader_->Finish()), records;
  stamps_.Finish(&checked);
  for (SurveyRecord& record : checked) jumps_.Add(std::move(record), &records);
  jumps_.Finish(&records);
  return records;
}

Counters CheckedReader::counters() const {
  Counters all = reader_->counters();
  const std::int64_t off = stamps_.left_out() + jumps_.left_out();
  if (off > 0) all["survey_stamps_far_off"] = off;
  if (at_zero_ > 0) all["survey_positions_at_zero"] = at_zero_;
  return all;
}

}  // namespace seastitch
