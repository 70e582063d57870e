#include "tools/replay_feed.hpp"

#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

#include "tools/merged_logs.hpp"
#include "tools/message_types.hpp"
#include "tools/ping_losses.hpp"
#include "tools/progress.hpp"

namespace seastitch {
namespace {

bool IsOfRole(const LogEvent& event, ChannelRole role) {
  const Channel* channel = FindChannel(event.channel);
  return channel != nullptr && channel->role == role;
}

// Publishes survey files as messages, as drivers would have.
void FeedSurvey(SurveyFiles* survey, Feeding* feeding) {
  const SurveyPlan& plan = survey->plan();
  std::fputs((feeding->quiet ? plan.warning : plan.Text()).c_str(), stderr);
  ProgressLine progress("reading", survey->bytes(), feeding->quiet);
  while (!feeding->stopped() && survey->PublishNext(feeding->bus)) {
    feeding->inputs->Reading(survey->file());
    feeding->bus->HandleAll();
    progress.Set(survey->bytes_read());
  }
  if (feeding->stopped()) {
    NoteStop(static_cast<int>(100 * survey->bytes_read() / survey->bytes()), feeding);
    return;
  }
  progress.Finish();
  for (const auto& [name, value] : survey->counters())
    if (value != 0) feeding->refused[name] = value;
  for (const auto& [name, value] : feeding->refused)
    if (!feeding->quiet)
      std::fprintf(stderr, "%s: %lld\n", name.c_str(), static_cast<long long>(value));
  if (const auto outcome = survey->Outcome()) throw DataError(*outcome);
}

}  // namespace

void NoteStop(int percent, Feeding* feeding) {
  feeding->partial =
      "Partial: the replay was interrupted after " + std::to_string(percent) + " % of the input.";
}

void FeedLogs(const RecordedLogs& recorded,
              ChannelRole role,
              RawReplay* raw,  // null: raw bytes are not decoded
              Feeding* feeding) {
  MergedLogs logs(recorded, feeding->quiet);
  MessageTypes types;
  bool any = false;
  while (!feeding->stopped()) {
    const std::optional<LogEvent> event = logs.Next();
    if (!event) break;
    const bool is_raw = raw != nullptr && IsOfRole(*event, ChannelRole::kRaw);
    // HEALTH gives the mapper the time that passes while sensors are silent.
    const bool is_health = role == ChannelRole::kSensor && event->channel == channels::kHealth;
    if (!is_raw && !is_health && !IsOfRole(*event, role)) continue;
    any = any || !is_health;
    if ((raw != nullptr && raw->MakesAnew(event->channel)) || !types.Add(*event)) continue;
    feeding->inputs->Reading(logs.log());
    if (is_raw)
      raw->Add(*event);
    else
      feeding->bus->PublishBytes(event->channel, event->data.data(), event->data.size());
    feeding->bus->HandleAll();
  }
  if (raw != nullptr) {
    raw->Finish();
    feeding->bus->HandleAll();
  }
  if (feeding->stopped()) NoteStop(logs.percent_read(), feeding);
  if (!any)
    throw DataError(recorded.recorders[0][0].string() +
                    ": no event on a channel that a replay reads");
  feeding->refused = logs.refused();
  if (raw != nullptr) feeding->refused.merge(raw->counters());
  for (const auto& [channel, events] : types.Foreign())
    feeding->refused["of_another_type_" + channel] = events;
  for (const auto& [reason, count] : feeding->refused)
    std::fprintf(stderr, "skipped: %s %lld\n", reason.c_str(), static_cast<long long>(count));
}

void FeedSubmaps(SubmapDirectory directory, Pipeline* pipeline, Feeding* feeding) {
  ProgressLine progress("registering submaps", directory.submaps.size(), feeding->quiet);
  std::size_t done = 0;
  for (Submap& submap : directory.submaps) {
    if (feeding->stopped())
      return NoteStop(static_cast<int>(100 * done / directory.submaps.size()), feeding);
    pipeline->mapper().AddSubmap(std::move(submap));
    pipeline->Settle();
    progress.Advance(1);
    ++done;
  }
  progress.Finish();
}

void PrintPingLosses(const Input& input, const Counters& mapper, bool quiet) {
  if (!input.survey_files) return;
  const PingLosses losses(input.survey_files->counters()["survey_pings"], mapper);
  if (!quiet || losses.is_warning) std::fputs(losses.text.c_str(), stderr);
}

void Feed(Input* input, RawReplay* raw, Feeding* feeding) {
  if (input->survey_files)
    FeedSurvey(input->survey_files.get(), feeding);
  else
    FeedLogs(*input->logs, ChannelRole::kSensor, raw, feeding);
}

}  // namespace seastitch
