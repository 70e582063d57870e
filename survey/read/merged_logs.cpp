#include "survey/read/merged_logs.hpp"

#include <algorithm>
#include <deque>
#include <limits>
#include <set>
#include <utility>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

std::uint64_t BytesIn(const RecordedLogs& logs) {
  std::uint64_t bytes = 0;
  for (const auto& recorder : logs.recorders)
    for (const LogPart& log : recorder) bytes += log.Size();
  return bytes;
}

}  // namespace

std::size_t WithoutRawBytes(const std::string& name) {
  const Channel* channel = FindChannel(name);
  const bool is_raw = channel != nullptr && channel->role == ChannelRole::kRaw;
  return is_raw ? kBytesOfPlace : std::numeric_limits<std::size_t>::max();
}

// The logs of one recorder.
class MergedLogs::Recorder {
 public:
  // first_log: number of its first log among the logs of all recorders.
  Recorder(std::vector<LogPart> logs, std::size_t first_log, EventLogReader::Wanted wanted)
      : logs_(std::move(logs)), first_log_(first_log), wanted_(std::move(wanted)) {
    Advance();
  }

  // Time for merging: that of the next event, or a later one of an earlier event if the clock
  // stepped back.
  std::int64_t utime() const { return utime_; }
  bool ended() const { return !next_; }
  std::int64_t damaged_bytes() const {
    return damaged_bytes_ + (reader_ ? reader_->damaged_bytes() : 0);
  }
  // Number of the next event's log.
  std::size_t log() const { return first_log_ + log_ - 1; }
  LogEvent Take() {
    LogEvent event = std::move(*next_);
    Advance();
    return event;
  }

 private:
  void Advance() {
    next_.reset();
    while (!next_ && (reader_ || log_ < logs_.size())) {
      if (!reader_) reader_.emplace(logs_[log_++], wanted_);
      next_ = reader_->Next();
      if (next_) continue;
      damaged_bytes_ += reader_->damaged_bytes();
      reader_.reset();
    }
    if (next_) utime_ = std::max(utime_, next_->utime);
  }

  std::vector<LogPart> logs_;
  const std::size_t first_log_;
  const EventLogReader::Wanted wanted_;
  std::size_t log_ = 0;
  std::optional<EventLogReader> reader_;
  std::optional<LogEvent> next_;
  std::int64_t utime_ = INT64_MIN;
  std::int64_t damaged_bytes_ = 0;
};

// Finds messages that were read before, by sender and sequence number.
class MergedLogs::DuplicateFilter {
 public:
  bool Add(const LogEvent& event) {
    const auto place = PlaceOf(event.data);
    if (!place) return false;
    Channel& channel = channels_[event.channel];
    const Key key{place->sender, place->seq, place->utime.value_or(place->recv_utime.value_or(0))};
    if (!channel.known.insert(key).second) {
      ++channel.doubled;
      return true;
    }
    channel.order.push_back(key);
    if (channel.order.size() > kRemembered) {
      channel.known.erase(channel.order.front());
      channel.order.pop_front();
    }
    return false;
  }
  void CountInto(std::map<std::string, std::int64_t>* counts) const {
    for (const auto& [name, channel] : channels_)
      if (channel.doubled > 0) (*counts)["doubled_" + name] = channel.doubled;
  }

 private:
  static constexpr std::size_t kRemembered = 10'000;  // 25 s of the fastest channel
  struct Key {
    std::string sender;
    std::int64_t seq;
    std::int64_t utime;
    auto operator<=>(const Key&) const = default;
  };
  struct Channel {
    std::set<Key> known;
    std::deque<Key> order;
    std::int64_t doubled = 0;
  };
  std::map<std::string, Channel> channels_;
};

MergedLogs::MergedLogs(const RecordedLogs& logs, EventLogReader::Wanted wanted, bool quiet)
    : total_(BytesIn(logs)), progress_("reading", total_, quiet) {
  std::size_t first_log = 0;
  for (const auto& recorder : logs.recorders) {
    recorders_.push_back(std::make_unique<Recorder>(recorder, first_log, wanted));
    first_log += recorder.size();
  }
  if (recorders_.size() > 1) duplicates_ = std::make_unique<DuplicateFilter>();
}

MergedLogs::~MergedLogs() = default;

std::optional<LogEvent> MergedLogs::Next() {
  while (true) {
    Recorder* first = nullptr;
    for (const auto& recorder : recorders_)
      if (!recorder->ended() && (first == nullptr || recorder->utime() < first->utime()))
        first = recorder.get();
    if (first == nullptr) {
      progress_.Finish();
      return std::nullopt;
    }
    log_ = first->log();
    LogEvent event = first->Take();
    read_ += SizeInLog(event);
    progress_.Set(read_);
    if (!duplicates_ || !duplicates_->Add(event)) return event;
  }
}

int MergedLogs::percent_read() const {
  return total_ == 0 ? 100 : static_cast<int>(100 * read_ / total_);
}

std::map<std::string, std::int64_t> MergedLogs::refused() const {
  std::map<std::string, std::int64_t> counts;
  for (const auto& recorder : recorders_)
    if (recorder->damaged_bytes() > 0) counts["damaged_bytes"] += recorder->damaged_bytes();
  if (duplicates_) duplicates_->CountInto(&counts);
  return counts;
}

}  // namespace seastitch
