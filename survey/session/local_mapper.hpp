#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/health/conditions.hpp"
#include "common/core/health/counters.hpp"
#include "common/core/sample.hpp"
#include "common/runtime/jobs_beside.hpp"
#include "mapper/mapper.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/registration/prepared_submaps.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "survey/session/computation_beside.hpp"

namespace seastitch {

// A mapper with its store of submaps. It registers a submap beside the samples that follow: the
// results are taken some seconds of the dive later, as at sea, or when another submap closes. So
// what comes out does not depend on how long a registration takes.
class LocalMapper {
 public:
  // on_event: gets everything that the mapper makes, in order. Submaps are stored in
  // config.map_dir. Throws std::runtime_error if that folder cannot be made.
  LocalMapper(const MapperConfig& config, std::function<void(const MapperEvent&)> on_event);
  LocalMapper(const LocalMapper&) = delete;
  LocalMapper& operator=(const LocalMapper&) = delete;

  void Add(const Received& received);
  // See Mapper::AddSubmap().
  void AddSubmap(Submap submap, std::optional<Mapper::OfDive> of_dive = std::nullopt);
  // Retries registrations: see Mapper::LookAgain().
  bool LookAgain();
  // Ends the dive, after the last sample.
  void Finish();

  Mapper& mapper() { return mapper_; }
  const Mapper& mapper() const { return mapper_; }
  // Those of mapper and store that are not zero.
  Counters counters() const;
  // Faults of mapper and store that hold now, as sentences, worst first. more: further ones.
  std::vector<std::string> Conditions(const std::vector<Condition>& more = {}) const;
  // The faults, what the mapper made, and the counters, in one line for people.
  std::string Statement(const std::vector<Condition>& more = {}) const;

 private:
  std::vector<Condition> Faults(const std::vector<Condition>& more) const;
  void Store(const JournalEntry& entry);
  void GiveEvents();
  void Deliver();
  void LookAgainNow();
  RegistrationResultSet Register(RegistrationJob job);
  bool AreResultsDue() const;
  void TakeResults();
  void FinishRegistering();  // of all submaps that closed

  const LoopCloserParams params_;
  Mapper mapper_;
  SurveyStore store_;
  PreparedSubmaps prepared_;
  const std::function<void(const MapperEvent&)> on_event_;
  bool store_fails_ = false;  // the last submap could not be written
  // Last: their threads use the others.
  ComputationBeside<RegistrationResultSet> registrations_;  // of a submap
  JobsBeside placing_;
  JobsBeside sorting_{&placing_};
};

}  // namespace seastitch
