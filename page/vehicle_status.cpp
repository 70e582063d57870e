#include "page/vehicle_status.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/health/conditions.hpp"
#include "common/core/pose.hpp"
#include "common/core/utf8.hpp"
#include "common/runtime/health.hpp"

namespace seastitch {

VehiclePlace PlaceOf(const nav_corrected_t& nav, std::optional<double> altitude_m) {
  const double* const q = nav.q_map_vehicle;
  const Eigen::Vector3d rpy =
      RpyFromRotation(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix());
  VehiclePlace place;
  place.utime = nav.utime;
  place.north_m = nav.p_map_vehicle_m[0];
  place.east_m = nav.p_map_vehicle_m[1];
  place.sigma_m =
      std::sqrt(std::max(0.0, nav.covariance_ned_rpy[0][0] + nav.covariance_ned_rpy[1][1]));
  place.depth_m = nav.p_map_vehicle_m[2];
  place.altitude_m = altitude_m;
  place.heading_deg = std::fmod(Rad2Deg(rpy.z()) + 360.0, 360.0);
  place.speed_mps = Hypotenuse(nav.v_map_mps[0], nav.v_map_mps[1]);
  return place;
}

std::optional<RecordedDive> DiveOf(const StatusView& view) {
  const health_t* const logger = view.roll.Find("logger");
  if (logger == nullptr || view.roll.SilentFor("logger", view.now_s) > kSilentS)
    return std::nullopt;
  return RecordedDive{ValueIn(*logger, HealthValue::kDiveStart),
                      ValueIn(*logger, HealthValue::kDiskFree)};
}

const char* StateOf(const health_t& health) {
  switch (health.state) {
    case health_t::STATE_STARTING: return "starting";
    case health_t::STATE_OK: return "ok";
    case health_t::STATE_DEGRADED: return "degraded";
    case health_t::STATE_LOST: return "lost";
    default: return "unknown";
  }
}

std::int64_t DropsOf(const health_t& health) {
  return ValueIn(health, HealthValue::kSocketDrops).value_or(0) +
         ValueIn(health, HealthValue::kEventsDropped).value_or(0);
}

std::string RemedyOf(const condition_t& condition) {
  for (const ConditionKind* kind : conditions::kAll)
    if (condition.name == kind->name) return kind->remedy;
  return "";
}

bool AllOk(const ProcessRoll& roll, double now_s) {
  const auto is_ok = [&](const char* process) {
    return roll.SilentFor(process, now_s) <= kSilentS && !roll.IsTwice(process, now_s) &&
           roll.Find(process)->state == health_t::STATE_OK;
  };
  return std::all_of(kProcesses.begin(), kProcesses.end(), is_ok) &&
         std::all_of(
             kOptionalProcesses.begin(), kOptionalProcesses.end(), [&](const char* process) {
               return roll.Find(process) == nullptr || is_ok(process);
             });
}

std::string StatusJson(const StatusView& view) {
  using Json = nlohmann::ordered_json;
  const auto number = [](std::optional<double> value) { return value ? Json(*value) : Json(); };
  Json vehicle;
  if (view.vehicle)
    vehicle = {{"utime", view.vehicle->utime},
               {"north_m", view.vehicle->north_m},
               {"east_m", view.vehicle->east_m},
               {"sigma_m", view.vehicle->sigma_m},
               {"depth_m", view.vehicle->depth_m},
               {"altitude_m", number(view.vehicle->altitude_m)},
               {"heading_deg", view.vehicle->heading_deg},
               {"speed_mps", view.vehicle->speed_mps}};
  Json processes = Json::array();
  for (const std::string& name : view.roll.names()) {
    const health_t* const health = view.roll.Find(name);
    const bool is_heard = view.roll.SilentFor(name, view.now_s) <= kSilentS;
    Json process{{"name", Printable(name)}, {"state", is_heard ? StateOf(*health) : "silent"}};
    if (is_heard) {
      process["text"] = Printable(health->text);
      process["version"] = Printable(health->version);
      process["uptime_s"] = health->uptime_s;
      process["restarts"] = health->restarts;
      process["runs_twice"] = view.roll.IsTwice(name, view.now_s);
      process["drops"] = DropsOf(*health);
      process["rates_hz"] = Json::object();
      for (std::size_t i = 0; i < health->rate_hz.size(); ++i)
        process["rates_hz"][Printable(health->rate_names[i])] = health->rate_hz[i];
      process["conditions"] = Json::array();
      for (const condition_t& condition : health->conditions)
        process["conditions"].push_back({{"name", Printable(condition.name)},
                                         {"sentence", Printable(condition.sentence)},
                                         {"remedy", RemedyOf(condition)}});
    }
    processes.push_back(std::move(process));
  }
  Json dive;
  if (const auto recorded = DiveOf(view))
    dive = {{"start_utime", recorded->start_utime.value_or(-1)},
            {"disk_free_mb", recorded->disk_free_mb.value_or(-1)}};
  const Json status{{"utime", view.now_utime},
                    {"ok", AllOk(view.roll, view.now_s)},
                    {"dive", dive},
                    {"vehicle", vehicle},
                    {"processes", processes}};
  return status.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace seastitch
