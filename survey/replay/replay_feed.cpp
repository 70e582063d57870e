#include "survey/replay/replay_feed.hpp"

#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

#include "survey/plan/ping_losses.hpp"
#include "survey/progress.hpp"
#include "survey/read/log_source.hpp"
#include "survey/read/message_types.hpp"
#include "survey/read/read_ahead.hpp"
#include "survey/read/recorded_results.hpp"

namespace seastitch {
namespace {

// progress: gets the percentage that was read.
void Pass(SampleSource* source,
          const TakeSample& take,
          const std::function<void(int)>& progress,
          ReplayInput* replay_input) {
  ReadAhead ahead(source);
  while (!replay_input->stopped()) {
    const std::optional<ReadAhead::Item> item = ahead.Next();
    if (!item) return;
    take(item->sample, item->input);
    progress(ahead.percent_read());
  }
  NoteStop(ahead.percent_read(), replay_input);
}

void PrintSkipped(const ReplayInput& replay_input) {
  for (const auto& [reason, count] : replay_input.refused)
    std::fprintf(stderr, "skipped: %s %lld\n", reason.c_str(), static_cast<long long>(count));
}

void FeedSurvey(SurveyFiles* survey, const TakeSample& take, ReplayInput* replay_input) {
  const SurveyPlan& plan = survey->plan();
  if (!replay_input->quiet) std::fputs(plan.Text().c_str(), stderr);
  ProgressLine progress("reading", 100, replay_input->quiet);
  const auto show = [&](int percent) { progress.Set(static_cast<std::uint64_t>(percent)); };
  Pass(survey, take, show, replay_input);
  if (replay_input->stopped()) return;
  progress.Finish();
  for (const auto& [name, value] : survey->refused())
    if (value != 0) replay_input->refused[name] = value;
  for (const auto& [name, value] : replay_input->refused)
    if (!replay_input->quiet)
      std::fprintf(stderr, "%s: %lld\n", name.c_str(), static_cast<long long>(value));
  if (const auto outcome = survey->Outcome()) throw DataError(*outcome);
}

InputFaults FeedLogs(LogSource* source, const TakeSample& take, ReplayInput* replay_input) {
  Pass(
      source, take, [](int) {}, replay_input);
  replay_input->refused = source->refused();
  PrintSkipped(*replay_input);
  return {source->conditions(), source->messages()};
}

}  // namespace

void NoteStop(int percent, ReplayInput* replay_input) {
  replay_input->partial =
      "Partial: the replay was interrupted after " + std::to_string(percent) + " % of the input.";
}

void FeedResults(const RecordedLogs& recorded,
                 SurveyCollector* collector,
                 ReplayInput* replay_input) {
  RecordedResults results(recorded, replay_input->quiet, collector);
  while (!replay_input->stopped() && results.Next()) {
  }
  if (replay_input->stopped()) NoteStop(results.percent_read(), replay_input);
  replay_input->refused = results.refused();
  PrintSkipped(*replay_input);
}

void FeedSubmaps(SubmapDirectory directory, MappingSession* session, ReplayInput* replay_input) {
  ProgressLine progress("registering submaps", directory.submaps.size(), replay_input->quiet);
  std::size_t done = 0;
  for (Submap& submap : directory.submaps) {
    if (replay_input->stopped())
      return NoteStop(static_cast<int>(100 * done / directory.submaps.size()), replay_input);
    session->AddSubmap(std::move(submap));
    progress.Advance(1);
    ++done;
  }
  progress.Finish();
}

DiveReport ReportOf(const LocalMapper& mapper, const InputFaults& faults) {
  Counters counters = mapper.counters();
  counters.insert(faults.messages.begin(), faults.messages.end());
  return {std::move(counters),
          mapper.Conditions(faults.conditions),
          mapper.mapper().noise().timing,
          mapper.mapper().stamp_offsets(),
          std::nullopt,
          mapper.mapper().dvl_turned_rad()};
}

void Warn(MapWarning warning, const std::string& dive, ReplayInput* replay_input) {
  if (!dive.empty()) warning.text = dive + ": " + warning.text;
  if (replay_input->said.insert(warning.text).second)
    std::fprintf(stderr, "warning: %s\n", warning.text.c_str());
  replay_input->warnings.push_back(std::move(warning));
}

void SayHowMapped(const Input& input,
                  const Mapper& mapper,
                  const std::string& dive,
                  ReplayInput* replay_input) {
  if (!input.survey_files) return;
  for (const MapWarning& warning : input.survey_files->warnings())
    Warn(warning, dive, replay_input);
  const PingLosses losses(
      input.survey_files->pings(), mapper.pings_lost(), mapper.positions_too_far());
  if (losses.is_warning)
    Warn({WarningCode::kPingsLost, losses.text}, dive, replay_input);
  else if (!replay_input->quiet)
    std::fprintf(stderr, "%s\n", losses.text.c_str());
}

void WarnOfDepths(const Mapper& mapper, const std::string& dive, ReplayInput* replay_input) {
  for (const Condition& fault : mapper.conditions()) {
    if (fault.kind == &conditions::kNoSoundSpeedProfile)
      Warn({WarningCode::kNoSoundSpeedProfile,
            "no sound speed profile: rays are straight (" + fault.detail +
                "); state one by --profile, or as sound_velocity_profile in a mapper.yaml for "
                "--config"},
           dive,
           replay_input);
    if (fault.kind == &conditions::kNoWaterLevel)
      Warn({WarningCode::kNoWaterLevel,
            std::string("depths are off by the tide: ") + fault.kind->sentence +
                (fault.detail.empty() ? "" : ": " + fault.detail)},
           dive,
           replay_input);
  }
}

InputFaults Feed(Input* input,
                 std::unique_ptr<RawReplay> raw,
                 const TakeSample& take,
                 ReplayInput* replay_input) {
  if (!input->survey_files) {
    LogSource source(*input->logs, std::move(raw), replay_input->quiet);
    return FeedLogs(&source, take, replay_input);
  }
  FeedSurvey(input->survey_files.get(), take, replay_input);
  return {input->survey_files->conditions(), {}};
}

}  // namespace seastitch
