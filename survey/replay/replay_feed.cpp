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
          Feeding* feeding) {
  ReadAhead ahead(source);
  while (!feeding->stopped()) {
    const std::optional<ReadAhead::Item> item = ahead.Next();
    if (!item) return;
    take(item->sample, item->input);
    progress(ahead.percent_read());
  }
  NoteStop(ahead.percent_read(), feeding);
}

void PrintSkipped(const Feeding& feeding) {
  for (const auto& [reason, count] : feeding.refused)
    std::fprintf(stderr, "skipped: %s %lld\n", reason.c_str(), static_cast<long long>(count));
}

void FeedSurvey(SurveyFiles* survey, const TakeSample& take, Feeding* feeding) {
  const SurveyPlan& plan = survey->plan();
  if (!feeding->quiet) std::fputs(plan.Text().c_str(), stderr);
  ProgressLine progress("reading", 100, feeding->quiet);
  const auto show = [&](int percent) { progress.Set(static_cast<std::uint64_t>(percent)); };
  Pass(survey, take, show, feeding);
  if (feeding->stopped()) return;
  progress.Finish();
  for (const auto& [name, value] : survey->refused())
    if (value != 0) feeding->refused[name] = value;
  for (const auto& [name, value] : feeding->refused)
    if (!feeding->quiet)
      std::fprintf(stderr, "%s: %lld\n", name.c_str(), static_cast<long long>(value));
  if (const auto outcome = survey->Outcome()) throw DataError(*outcome);
}

InputFaults FeedLogs(LogSource* source, const TakeSample& take, Feeding* feeding) {
  Pass(
      source, take, [](int) {}, feeding);
  feeding->refused = source->refused();
  PrintSkipped(*feeding);
  return {source->conditions(), source->messages()};
}

}  // namespace

void NoteStop(int percent, Feeding* feeding) {
  feeding->partial =
      "Partial: the replay was interrupted after " + std::to_string(percent) + " % of the input.";
}

void FeedResults(const RecordedLogs& recorded, SurveyCollector* collector, Feeding* feeding) {
  RecordedResults results(recorded, feeding->quiet, collector);
  while (!feeding->stopped() && results.Next()) {
  }
  if (feeding->stopped()) NoteStop(results.percent_read(), feeding);
  feeding->refused = results.refused();
  PrintSkipped(*feeding);
}

void FeedSubmaps(SubmapDirectory directory, MappingSession* session, Feeding* feeding) {
  ProgressLine progress("registering submaps", directory.submaps.size(), feeding->quiet);
  std::size_t done = 0;
  for (Submap& submap : directory.submaps) {
    if (feeding->stopped())
      return NoteStop(static_cast<int>(100 * done / directory.submaps.size()), feeding);
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

void Warn(MapWarning warning, const std::string& dive, Feeding* feeding) {
  if (!dive.empty()) warning.text = dive + ": " + warning.text;
  if (feeding->said.insert(warning.text).second)
    std::fprintf(stderr, "warning: %s\n", warning.text.c_str());
  feeding->warnings.push_back(std::move(warning));
}

void SayHowMapped(const Input& input,
                  const Mapper& mapper,
                  const std::string& dive,
                  Feeding* feeding) {
  if (!input.survey_files) return;
  for (const MapWarning& warning : input.survey_files->warnings()) Warn(warning, dive, feeding);
  const PingLosses losses(
      input.survey_files->pings(), mapper.pings_lost(), mapper.positions_too_far());
  if (losses.is_warning)
    Warn({WarningCode::kPingsLost, losses.text}, dive, feeding);
  else if (!feeding->quiet)
    std::fprintf(stderr, "%s\n", losses.text.c_str());
}

void WarnOfDepths(const Mapper& mapper, const std::string& dive, Feeding* feeding) {
  for (const Condition& fault : mapper.conditions()) {
    if (fault.kind == &conditions::kNoSoundSpeedProfile)
      Warn({WarningCode::kNoSoundSpeedProfile,
            "no sound speed profile: rays are straight (" + fault.detail +
                "); state one by --profile, or as sound_velocity_profile in a mapper.yaml for "
                "--config"},
           dive,
           feeding);
    if (fault.kind == &conditions::kNoWaterLevel)
      Warn({WarningCode::kNoWaterLevel,
            std::string("depths are off by the tide: ") + fault.kind->sentence +
                (fault.detail.empty() ? "" : ": " + fault.detail)},
           dive,
           feeding);
  }
}

InputFaults Feed(Input* input,
                 std::unique_ptr<RawReplay> raw,
                 const TakeSample& take,
                 Feeding* feeding) {
  if (!input->survey_files) {
    LogSource source(*input->logs, std::move(raw), feeding->quiet);
    return FeedLogs(&source, take, feeding);
  }
  FeedSurvey(input->survey_files.get(), take, feeding);
  return {input->survey_files->conditions(), {}};
}

}  // namespace seastitch
