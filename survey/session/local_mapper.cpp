#include "survey/session/local_mapper.hpp"

#include <memory>
#include <variant>

#include "common/runtime/for_each_beside.hpp"
#include "common/runtime/health.hpp"

namespace seastitch {
LocalMapper::LocalMapper(const MapperConfig& config,
                         std::function<void(const MapperEvent&)> on_event)
    : params_(config.loop_closer),
      mapper_(config),
      store_({config.map_dir, config.max_cached_mb, config.max_unsaved_mb, PowerCut::kMayLoseFile}),
      prepared_(config.loop_closer.registration),
      on_event_(std::move(on_event)) {
  SurveyStore::MakeDirectory(config.map_dir);
  mapper_.UseThreads(ForEachBeside, &placing_, &sorting_);
}

void LocalMapper::Add(const Received& received) {
  std::visit(Overloaded{[this](const Heartbeat& heartbeat) { mapper_.OnHeartbeat(heartbeat); },
                        [&]<class T>(const T& sample) {
                          mapper_.Add(sample, received.stamp);
                          Deliver();
                          if constexpr (kIsOfNavigation<T>)
                            if (mapper_.LookAgain()) LookAgainNow();
                        }},
             received.sample);
}

void LocalMapper::AddSubmap(Submap submap, std::optional<Mapper::OfDive> of_dive) {
  if (of_dive)
    mapper_.AddSubmap(std::move(submap), *std::move(of_dive));
  else
    mapper_.AddSubmap(std::move(submap));
  Deliver();
  FinishRegistering();
}

bool LocalMapper::LookAgain() {
  const bool left = mapper_.LookAgain();
  if (left) LookAgainNow();
  return left;
}

// Retries are few, and run at once.
void LocalMapper::LookAgainNow() {
  if (auto job = mapper_.NextJob()) mapper_.Take(Register(*std::move(job)));
  Deliver();
}

void LocalMapper::Finish() {
  mapper_.Finish();
  Deliver();
  FinishRegistering();
}

void LocalMapper::Store(const JournalEntry& entry) {
  const auto* const closed = std::get_if<ClosedSubmap>(&entry);
  if (closed == nullptr || closed->submap->cloud.empty()) return;
  const std::int64_t errors = store_.counters().write_errors;
  store_.Put(closed->submap);
  store_fails_ = store_.counters().write_errors > errors;
}

void LocalMapper::GiveEvents() {
  for (const MapperEvent& event : mapper_.TakeEvents()) {
    if (const auto* entry = std::get_if<JournalEntry>(&event)) Store(*entry);
    on_event_(event);
  }
}

// A submap is registered after it is stored, because jobs load its points.
void LocalMapper::Deliver() {
  GiveEvents();
  while (registrations_.IsRunning() ? AreResultsDue() : mapper_.HasSubmapToRegister()) {
    if (registrations_.IsRunning()) {
      TakeResults();
      GiveEvents();
    } else if (auto job = mapper_.NextJob()) {
      registrations_.Start(mapper_.last_nav(), [this, job = *std::move(job)]() mutable {
        return Register(std::move(job));
      });
    } else {
      return;
    }
  }
}

bool LocalMapper::AreResultsDue() const {
  return mapper_.submaps_to_register() > 1 || registrations_.IsDue(mapper_.last_nav());
}

void LocalMapper::TakeResults() { mapper_.Take(registrations_.Take()); }

void LocalMapper::FinishRegistering() {
  while (registrations_.IsRunning()) {
    TakeResults();
    Deliver();
  }
}

RegistrationResultSet LocalMapper::Register(RegistrationJob job) {
  const LoadSubmap load = [this](SubmapId id) { return store_.Get(id); };
  return Run(std::move(job), params_, load, &prepared_, ForEachBeside);
}

Counters LocalMapper::counters() const {
  Counters counters = mapper_.counters();
  counters.merge(store_.counters().ByName());
  std::erase_if(counters, [](const auto& counter) { return counter.second == 0; });
  return counters;
}

std::vector<Condition> LocalMapper::Faults(const std::vector<Condition>& more) const {
  std::vector<Condition> faults = mapper_.conditions();
  if (store_fails_) faults.push_back({&conditions::kStoreNotWriting, ""});
  if (const std::string lost = store_.counters().PointsLost(); !lost.empty())
    faults.push_back({&conditions::kPointsLost, lost});
  faults.insert(faults.end(), more.begin(), more.end());
  return faults;
}

std::vector<std::string> LocalMapper::Conditions(const std::vector<Condition>& more) const {
  Health health("mapper");
  health.SetConditions(Faults(more));
  std::vector<std::string> sentences;
  for (const condition_t& condition : health.Snapshot(0, 1.0).conditions)
    sentences.push_back(condition.sentence);
  return sentences;
}

std::string LocalMapper::Statement(const std::vector<Condition>& more) const {
  Health health("mapper");
  health.SetConditions(Faults(more));
  health.SetText(mapper_.Summary());
  if (mapper_.IsWaiting()) health.SetStarting(mapper_.WaitsFor());
  std::string statement = health.text();
  for (const auto& [name, value] : counters())
    statement += ", " + name + " " + std::to_string(value);
  return statement;
}

}  // namespace seastitch
