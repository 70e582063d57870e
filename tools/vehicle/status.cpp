#include "tools/vehicle/status.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "common/core/time.hpp"
#include "common/core/utf8.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/event_loop.hpp"
#include "common/runtime/health.hpp"
#include "page/status_listener.hpp"
#include "tools/vehicle/terminal_text.hpp"

namespace seastitch {
namespace {

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

std::string RatesOf(const health_t& health) {
  std::ostringstream rates;
  for (std::size_t i = 0; i < health.rate_hz.size(); ++i) {
    char hz[32];
    std::snprintf(hz, sizeof hz, health.rate_hz[i] < 9.95 ? "%.1f" : "%.0f", health.rate_hz[i]);
    rates << (i == 0 ? "" : ", ") << health.rate_names[i] << ' ' << hz;
  }
  return Printable(rates.str());
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

std::string DiveLine(const StatusView& view) {
  const std::optional<RecordedDive> dive = DiveOf(view);
  if (!dive) return "no dive is recorded: no logger";
  std::string line = "dive";
  if (dive->start_utime)
    line += " since " + UtcText(FromUtime(*dive->start_utime), "%Y-%m-%d %H:%M:%S") + " (" +
            Span(1e-6 * static_cast<double>(view.now_utime - *dive->start_utime)) + ")";
  if (dive->disk_free_mb) {
    char text[60];
    std::snprintf(text,
                  sizeof text,
                  ", %.1f GB of disk left",
                  1e-3 * static_cast<double>(*dive->disk_free_mb));
    line += text;
  }
  return line;
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
  std::vector<std::string> lines{
      Cut(UtcText(FromUtime(view.now_utime), "%H:%M:%S UTC  ") + DiveLine(view), columns)};
  if (view.vehicle) lines.push_back(Cut(VehicleLine(*view.vehicle), columns));
  lines.push_back(Row("process", "state", "drops", "messages a second", "", columns));
  for (const std::string& process : roll.names())
    lines.push_back(RowOf(Printable(process), roll, now_s, columns));
  for (const std::string& process : roll.names())
    if (const health_t* health = roll.Find(process))
      if (roll.SilentFor(process, now_s) <= kSilentS) AddFaults(process, *health, columns, &lines);
  return lines;
}

int RunStatus(const StatusOptions& options) {
  EventLoop loop;
  Bus bus(options.lcm_url);
  const StatusListener listener(&bus);
  loop.Add(bus.fd(), [&] { bus.HandleAll(Bus::kBurst); });
  const bool live = !options.once && !options.json && isatty(STDOUT_FILENO) == 1;
  int code = EXIT_SUCCESS;
  if (live) {
    Screen screen;
    const auto show = [&] {
      screen.Show(StatusLines(listener.View(), TerminalSize(&winsize::ws_col, kTerminalColumns)));
    };
    show();
    loop.Every(std::chrono::seconds(1), show);
    code = loop.Run();
  } else {
    loop.Every(kOnce, [&] { loop.Stop(); });
    code = loop.Run();
  }
  if (options.json) {
    std::fputs(StatusJson(listener.View()).c_str(), stdout);
  } else {
    for (const std::string& line :
         StatusLines(listener.View(), TerminalSize(&winsize::ws_col, kWhole)))
      std::printf("%s\n", line.c_str());
  }
  if (code != EXIT_SUCCESS) return code;
  return AllOk(listener.View().roll, MonotonicSeconds()) ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace seastitch
