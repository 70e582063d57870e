#include "tools/vehicle/status.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/convert/channels.hpp"
#include "common/core/conditions.hpp"
#include "common/core/pose.hpp"
#include "common/core/time.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "seastitch/dvl_t.hpp"
#include "tools/vehicle/terminal_text.hpp"

namespace seastitch {
namespace {

constexpr double kSilentS = 3.0;
constexpr std::chrono::milliseconds kOnce(2500);  // HEALTH is sent once a second
constexpr std::size_t kTerminalColumns = 80;      // where it does not say
constexpr std::size_t kWhole = 100'000;           // columns of a pipe or file

std::string Padded(const std::string& text, std::size_t columns) {
  std::string cell = Cut(text, columns);
  cell.resize(std::max(cell.size(), columns), ' ');
  return cell;
}

std::string Span(double seconds) {
  const long long minutes = static_cast<long long>(std::max(0.0, seconds)) / 60;
  char text[40];
  std::snprintf(text, sizeof text, "%lld h %02lld min", minutes / 60, minutes % 60);
  return text;
}

std::int64_t CounterOf(const health_t& health, const std::string& name) {
  for (const counter_t& counter : health.counters)
    if (counter.name == name) return counter.value;
  return -1;
}

std::int64_t DropsOf(const health_t& health) {
  std::int64_t drops = 0;
  for (const counter_t& counter : health.counters)
    if (counter.name.starts_with("socket_drops_") || counter.name == "events_dropped")
      drops += counter.value;
  return drops;
}

std::string RatesOf(const health_t& health) {
  std::ostringstream rates;
  for (std::size_t i = 0; i < health.rate_hz.size(); ++i) {
    char hz[32];
    std::snprintf(hz, sizeof hz, health.rate_hz[i] < 9.95 ? "%.1f" : "%.0f", health.rate_hz[i]);
    rates << (i == 0 ? "" : ", ") << health.rate_names[i] << ' ' << hz;
  }
  return Printable(rates.str());
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

std::string Row(const std::string& process,
                const std::string& state,
                const std::string& drops,
                const std::string& rates,
                const std::string& sentence,
                std::size_t columns) {
  std::string right_aligned_drops(drops.size() < 6 ? 6 - drops.size() : 0, ' ');
  right_aligned_drops += drops;
  return Cut(Padded(process, 11) + "  " + Padded(state, 8) + right_aligned_drops + "  " +
                 Padded(rates, 20) + "  " + sentence,
             columns);
}

std::string RowOf(const std::string& process,
                  const ProcessRoll& roll,
                  double now_s,
                  std::size_t columns) {
  const health_t* const health = roll.Find(process);
  if (health == nullptr) return Row(process, "-", "-", "", "not heard", columns);
  if (const double silent_s = roll.SilentFor(process, now_s); silent_s > kSilentS) {
    char text[60];
    std::snprintf(text, sizeof text, "not heard for %.0f s", silent_s);
    return Row(process, "silent", "-", "", text, columns);
  }
  const std::string twice = roll.IsTwice(process, now_s) ? "runs twice; " : "";
  return Row(process,
             StateOf(*health),
             std::to_string(DropsOf(*health)),
             RatesOf(*health),
             twice + Printable(health->text),
             columns);
}

// The dive, as the logger reports it.
std::string DiveLine(const ProcessRoll& roll, double now_s, std::int64_t now_utime) {
  const health_t* const logger = roll.Find("logger");
  if (logger == nullptr || roll.SilentFor("logger", now_s) > kSilentS)
    return "no dive is recorded: no logger";
  std::string line = "dive";
  if (const std::int64_t start = CounterOf(*logger, "dive_start_utime"); start > 0)
    line += " since " + UtcText(FromUtime(start), "%Y-%m-%d %H:%M:%S") + " (" +
            Span(1e-6 * static_cast<double>(now_utime - start)) + ")";
  if (const std::int64_t free_mb = CounterOf(*logger, "disk_free_mb"); free_mb >= 0) {
    char text[60];
    std::snprintf(text, sizeof text, ", %.1f GB of disk left", 1e-3 * static_cast<double>(free_mb));
    line += text;
  }
  return line;
}

// Empty for a fault of another version of the program.
std::string RemedyOf(const condition_t& condition) {
  for (const ConditionKind* kind : conditions::kAll)
    if (condition.name == kind->name) return kind->remedy;
  return "";
}

void AddFaults(const std::string& process,
               const health_t& health,
               std::size_t columns,
               std::vector<std::string>* lines) {
  const auto add = [&](const std::string& indent, const std::string& text) {
    const std::vector<std::string> wrapped = Wrap(indent, text, columns);
    lines->insert(lines->end(), wrapped.begin(), wrapped.end());
  };
  for (const condition_t& condition : health.conditions) {
    lines->emplace_back();
    add("", process + ": " + Printable(condition.sentence));
    if (const std::string remedy = RemedyOf(condition); !remedy.empty()) add("    ", remedy);
  }
}

std::size_t TerminalSize(unsigned short winsize::*dimension, std::size_t fallback) {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.*dimension > 0;
  return known ? size.*dimension : fallback;
}

// The terminal's alternate screen: at the end the former content returns.
class Screen {
 public:
  Screen() { std::fputs("\x1b[?1049h\x1b[?25l", stdout); }
  ~Screen() {
    std::fputs("\x1b[?25h\x1b[?1049l", stdout);
    std::fflush(stdout);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void Show(const std::vector<std::string>& lines) {
    const std::size_t rows = TerminalSize(&winsize::ws_row, 24);
    std::fputs("\x1b[H", stdout);
    for (std::size_t i = 0; i < lines.size() && i + 1 < rows; ++i)
      std::printf("%s\x1b[K\n", lines[i].c_str());
    std::fputs("\x1b[J", stdout);
    std::fflush(stdout);
  }
};

}  // namespace

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

std::string VehicleLine(const VehiclePlace& place) {
  char altitude[40] = "";
  if (place.altitude_m)
    std::snprintf(altitude, sizeof altitude, ", altitude %.1f m", *place.altitude_m);
  char text[240];
  std::snprintf(text,
                sizeof text,
                "vehicle: north %.1f m, east %.1f m of the map origin (1 sigma %.1f m), depth %.1f "
                "m%s, heading %.1f deg, %.2f m/s",
                place.north_m,
                place.east_m,
                place.sigma_m,
                place.depth_m,
                altitude,
                place.heading_deg,
                place.speed_mps);
  return text;
}

std::vector<std::string> StatusLines(const StatusView& view, std::size_t columns) {
  const ProcessRoll& roll = view.roll;
  const double now_s = view.now_s;
  std::vector<std::string> lines{Cut(
      UtcText(FromUtime(view.now_utime), "%H:%M:%S UTC  ") + DiveLine(roll, now_s, view.now_utime),
      columns)};
  if (view.vehicle) lines.push_back(Cut(VehicleLine(*view.vehicle), columns));
  lines.push_back(Row("process", "state", "drops", "messages a second", "", columns));
  for (const std::string& process : roll.names())
    lines.push_back(RowOf(Printable(process), roll, now_s, columns));
  for (const std::string& process : roll.names())
    if (const health_t* health = roll.Find(process))
      if (roll.SilentFor(process, now_s) <= kSilentS) AddFaults(process, *health, columns, &lines);
  return lines;
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
  const health_t* const logger = view.roll.Find("logger");
  const bool records = logger != nullptr && view.roll.SilentFor("logger", view.now_s) <= kSilentS;
  Json dive;
  if (records)
    dive = {{"start_utime", CounterOf(*logger, "dive_start_utime")},
            {"disk_free_mb", CounterOf(*logger, "disk_free_mb")}};
  const Json status{{"utime", view.now_utime},
                    {"ok", AllOk(view.roll, view.now_s)},
                    {"dive", dive},
                    {"vehicle", vehicle},
                    {"processes", processes}};
  return status.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
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

int RunStatus(const StatusOptions& options) {
  EventLoop loop;
  Bus bus(options.lcm_url);
  ProcessRoll roll;
  bus.Subscribe<health_t>(channels::kHealth, QueueOf(channels::kHealth), [&](const health_t& msg) {
    roll.Add(msg, MonotonicSeconds());
  });
  std::optional<nav_corrected_t> nav;
  std::optional<double> altitude_m;
  double nav_s = 0.0, altitude_s = 0.0;  // when they were heard
  bus.Subscribe<nav_corrected_t>(
      channels::kNavCorrected, QueueOf(channels::kNavCorrected), [&](const nav_corrected_t& msg) {
        nav = msg;
        nav_s = MonotonicSeconds();
      });
  bus.Subscribe<dvl_t>(channels::kDvl, QueueOf(channels::kDvl), [&](const dvl_t& msg) {
    if (!msg.has_altitude) return;
    altitude_m = msg.altitude_m;
    altitude_s = MonotonicSeconds();
  });
  loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
  const auto view = [&] {
    StatusView now{roll, std::nullopt, MonotonicSeconds(), NowUtime()};
    if (nav && now.now_s - nav_s < kSilentS)
      now.vehicle = PlaceOf(*nav, now.now_s - altitude_s < kSilentS ? altitude_m : std::nullopt);
    return now;
  };
  const bool live = !options.once && !options.json && isatty(STDOUT_FILENO) == 1;
  int code = EXIT_SUCCESS;
  if (live) {
    Screen screen;
    const auto show = [&] {
      screen.Show(StatusLines(view(), TerminalSize(&winsize::ws_col, kTerminalColumns)));
    };
    show();
    loop.Every(std::chrono::seconds(1), show);
    code = loop.Run();
  } else {
    loop.Every(kOnce, [&] { loop.Stop(); });
    code = loop.Run();
  }
  if (options.json) {
    std::fputs(StatusJson(view()).c_str(), stdout);
  } else {
    for (const std::string& line : StatusLines(view(), TerminalSize(&winsize::ws_col, kWhole)))
      std::printf("%s\n", line.c_str());
  }
  if (code != EXIT_SUCCESS) return code;
  return AllOk(roll, MonotonicSeconds()) ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace seastitch
