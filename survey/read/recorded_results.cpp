#include "survey/read/recorded_results.hpp"

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

template <class Msg>
std::optional<Msg> Decoded(const LogEvent& event) {
  Msg msg{};  // braces: generated types do not zero themselves
  const auto size = static_cast<int>(event.data.size());
  if (msg.decode(event.data.data(), 0, size) != size) return std::nullopt;
  return msg;
}

}  // namespace

RecordedResults::RecordedResults(const RecordedLogs& recorded,
                                 bool quiet,
                                 SurveyCollector* collector)
    : first_log_(recorded.recorders[0][0].path),
      logs_(recorded, WithoutRawBytes, quiet),
      collector_(collector) {}

bool RecordedResults::Next() {
  const std::optional<LogEvent> event = logs_.Next();
  if (!event && !any_)
    throw DataError(first_log_.string() + ": no event on a channel that a replay reads");
  if (!event) return false;
  const Channel* const channel = FindChannel(event->channel);
  if (channel == nullptr || channel->role != ChannelRole::kResult) return true;
  any_ = true;
  if (types_.Add(*event)) Use(*event);
  return true;
}

void RecordedResults::Use(const LogEvent& event) {
  const auto give = [this](const auto& result) {
    if (result) collector_->Add(*result);
  };
  if (event.channel == channels::kNav) {
    if (const auto msg = Decoded<nav_t>(event)) give(FromLcm(*msg));
  } else if (event.channel == channels::kNavCorrected) {
    if (const auto msg = Decoded<nav_corrected_t>(event)) give(FromLcm(*msg));
  } else if (event.channel == channels::kSubmap) {
    if (const auto msg = Decoded<submap_t>(event)) give(submaps_.Add(*msg));
  } else if (event.channel == channels::kSubmapPoints) {
    if (const auto msg = Decoded<submap_points_t>(event)) give(submaps_.Add(*msg));
  } else if (event.channel == channels::kGraphUpdate) {
    if (const auto msg = Decoded<graph_update_t>(event)) give(FromLcm(*msg));
  } else if (event.channel == channels::kPoseGraph) {
    if (const auto msg = Decoded<pose_graph_t>(event)) give(graphs_.Add(*msg));
  }
}

Counters RecordedResults::refused() const {
  Counters refused = logs_.refused();
  for (const auto& [channel, events] : types_.Foreign())
    refused["of_another_type_" + channel] = events;
  return refused;
}

}  // namespace seastitch
