#include "tools/several_dives.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "products/sounding_log.hpp"
#include "tools/dive_front.hpp"
#include "tools/message_types.hpp"
#include "tools/other_navigation.hpp"
#include "tools/ping_inputs.hpp"

namespace seastitch {
namespace {

// Publishes one of several dives.
void FeedOneOfSeveral(Dive* dive, Unread* unread, Feeding* feeding) {
  const std::map<std::string, std::int64_t> refused_before = std::exchange(feeding->refused, {});
  unread->Try(dive->name, [&] { Feed(&dive->input, nullptr, feeding); });
  for (const auto& [reason, count] : refused_before) feeding->refused[reason] += count;
}

}  // namespace

bool Unread::Try(const std::string& dive, const std::function<void()>& step) {
  try {
    step();
    return true;
  } catch (const std::runtime_error& e) {
    if (!several_) throw;
    if (!first_) first_ = std::current_exception();
    std::fprintf(stderr, "%s: left out: %s\n", dive.c_str(), e.what());
    dives_.push_back({dive, e.what()});
    return false;
  }
}

void TakeNoise(const Mapper& mapper, const MapperConfig& config, ProductOptions* products) {
  products->noise = mapper.noise();
  if (!config.loop_closer.estimate_noise) products->noise_not_estimated = "estimate_noise is off";
}

void ExpectSubmaps(const SurveyCollector& collector,
                   bool survey_files,
                   const std::string& statement,
                   const Feeding& feeding) {
  if (collector.submaps() > 0) return;
  if (!feeding.partial.empty()) throw std::runtime_error("no submap: " + feeding.partial);
  if (survey_files) throw DataError("no submap: " + statement);
  throw std::runtime_error("no submap: " + statement);
}

void UseDatum(const Datum& datum, std::vector<Dive>* dives) {
  const GeographicLib::LocalCartesian map(datum.latitude_deg, datum.longitude_deg, 0.0);
  for (Dive& dive : *dives) {
    VehicleGeometry& vehicle = dive.mapper.vehicle;
    const GeographicLib::LocalCartesian own(
        Rad2Deg(vehicle.datum_latitude_rad), Rad2Deg(vehicle.datum_longitude_rad), 0.0);
    NavigationParams& start = dive.mapper.navigation;
    double latitude_deg = 0.0, longitude_deg = 0.0, up_m = 0.0;
    own.Reverse(start.start_east_m, start.start_north_m, 0.0, latitude_deg, longitude_deg, up_m);
    map.Forward(latitude_deg, longitude_deg, 0.0, start.start_east_m, start.start_north_m, up_m);
    vehicle.datum_latitude_rad = Deg2Rad(datum.latitude_deg);
    vehicle.datum_longitude_rad = Deg2Rad(datum.longitude_deg);
  }
}

std::vector<SurveyInput> RemakeTogether(std::vector<Dive>* dives,
                                        const std::filesystem::path& store,
                                        SurveyCollector* collector,
                                        ProductOptions* products,
                                        Unread* unread,
                                        Feeding* feeding) {
  Bus* const bus = feeding->bus;
  SoundingLog* const soundings = products->soundings;
  MapperConfig all = dives->front().mapper;
  all.map_dir = store / "all";
  Pipeline pipeline(dives->front().config, all, bus, feeding->stopped);
  std::vector<SurveyInput> spans;
  std::int32_t next_id = 0;
  std::string statements;
  for (std::size_t k = 0; k < dives->size() && !feeding->stopped(); ++k) {
    Dive& dive = (*dives)[k];
    collector->BeginDive(dive.name);
    dive.mapper.map_dir = store / std::to_string(k);
    DiveFront front(
        dive.mapper,
        static_cast<std::int32_t>(k),
        next_id,
        [&](Submap submap, Mapper::OfDive of_dive) {
          pipeline.mapper().AddSubmap(std::move(submap), std::move(of_dive));
          pipeline.Settle();
        },
        [&](const NavState& nav) { collector->Add(nav); });
    PingInputs inputs(
        dive.input.names, soundings != nullptr, dive.mapper.sonar_time_offset_s, front.bus());
    const auto first_input = static_cast<std::uint16_t>(spans.size());
    if (soundings != nullptr)
      front.mapper().OnSoundings([&](SubmapSoundings submap) {
        std::vector<std::uint16_t> of_pings = inputs.Take(submap);
        for (std::uint16_t& input : of_pings)
          input = static_cast<std::uint16_t>(input + first_input);
        submap.id.value += next_id;
        soundings->Add(submap, of_pings);
      });
    std::optional<OtherNavigation> other;
    if (dive.input.logs) other.emplace(dive.mapper, front.bus());
    feeding->bus = front.bus();
    feeding->inputs = &inputs;
    if (!feeding->quiet) std::fprintf(stderr, "dive %s\n", dive.name.c_str());
    FeedOneOfSeveral(&dive, unread, feeding);
    front.Finish();
    if (other)
      feeding->other_tracks.push_back(
          {static_cast<std::int32_t>(k), other->source(), other->Finish()});
    products->dives.push_back(ReportOf(&front.mapper()));
    next_id = front.next_id();
    statements += dive.name + ": " + front.mapper().health().text() + "; ";
    spans.insert(spans.end(), inputs.spans().begin(), inputs.spans().end());
  }
  pipeline.Finish();
  feeding->bus = bus;
  products->mapper_counters = CountersOf(&pipeline.mapper());
  products->conditions = ConditionsOf(&pipeline.mapper());
  TakeNoise(pipeline.mapper().mapper(), dives->front().mapper, products);
  ExpectSubmaps(*collector, dives->front().input.survey_files != nullptr, statements, *feeding);
  return spans;
}

}  // namespace seastitch
