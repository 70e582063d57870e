#pragma once

#include <exception>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "products/write_products.hpp"
#include "survey/replay/calibration_rounds.hpp"
#include "survey/replay/replay_feed.hpp"
#include "survey/replay/replay_input.hpp"

namespace seastitch {

// The dives of a replay that were not read, or not to their end.
class SkippedDives {
 public:
  // several: a dive that fails is left out and named, else its exception is passed on.
  explicit SkippedDives(bool several) : several_(several) {}

  // False: it failed.
  bool Try(const std::string& dive, const std::function<void()>& step);
  // One that a finished map lacks.
  void Add(const UnreadDive& dive);
  [[noreturn]] void ThrowFirst() const { std::rethrow_exception(first_); }
  const std::vector<UnreadDive>& dives() const { return dives_; }

 private:
  bool Has(const std::string& name) const;

  const bool several_;
  std::exception_ptr first_;
  std::vector<UnreadDive> dives_;
};

// Takes what the mapper found about the noise.
void TakeNoise(const Mapper& mapper, const MapperConfig& config, ProductOptions* products);

// Throws if there is no submap: std::runtime_error, of survey files DataError.
void ExpectSubmaps(const SurveyCollector& collector,
                   bool survey_files,
                   const std::string& statement,
                   const ReplayInput& replay_input);

// Sets one datum for all dives, and converts each dive's start position to it.
void UseDatum(const Datum& datum, std::vector<Dive>* dives);

// Places the dives that have positions of a grid in that of the first one.
void ShareGrid(const std::vector<Dive>& dives);

// What a replay fills besides the products.
struct Outputs {
  SurveyCollector* collector;
  ProductOptions* products;
  std::function<void(const MapperEvent&)> on_event;  // gets the events of the map's mapper
  CalibrationRounds* rounds;
};

// Maps several dives together, and finished maps with their dives. A front end per dive makes its
// submaps; one back end makes one graph of all. Files of the inputs are numbered consecutively.
void RemakeTogether(std::vector<Dive>* dives,
                    const std::filesystem::path& store,
                    const Outputs& outputs,
                    SkippedDives* unread,
                    ReplayInput* replay_input);

}  // namespace seastitch
