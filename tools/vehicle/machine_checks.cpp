#include "tools/vehicle/machine_checks.hpp"

#include <arpa/inet.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <thread>

#include "common/runtime/files/whole_file.hpp"
#include "drivers/socket/file_descriptor.hpp"
#include "drivers/socket/source_url.hpp"
#include "page/page_server.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

template <class... Args>
std::string Format(const char* format, Args... args) {
  char text[200];
  std::snprintf(text, sizeof text, format, args...);
  return text;
}

// Empty where it cannot be read.
std::string ReadFile(const fs::path& path) { return ReadWholeFile(path).value_or(""); }

// The first entry of the output of `ip -json ...`.
std::optional<Json> AskIp(const Machine& machine, std::vector<std::string> words) {
  words.insert(words.begin(), {"ip", "-json"});
  const std::optional<std::string> text = machine.run(words);
  if (!text) return std::nullopt;
  const Json answer = Json::parse(*text, nullptr, false);
  if (!answer.is_array() || answer.empty() || !answer[0].is_object()) return std::nullopt;
  return answer[0];
}

std::string StringIn(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

// Bit rate of "1M", "500K", "250000" [bit/s]; 0 for any other text.
std::int64_t BitRateOf(const std::string& text) {
  std::smatch parts;
  if (!std::regex_match(text, parts, std::regex("\\s*([0-9]{1,9})\\s*([KMG]?)\\s*"))) return 0;
  const std::map<std::string, std::int64_t> scale{
      {"", 1}, {"K", 1'000}, {"M", 1'000'000}, {"G", 1'000'000'000}};
  return std::stoll(parts[1]) * scale.at(parts[2]);
}

// Text after the last line KEY= of a file with such lines; empty if there is none.
std::string LastValue(const std::string& text, const std::string& key) {
  const std::regex line("(^|\n)[ \t]*" + key + "[ \t]*=[ \t]*([^\n]*)");
  std::string value;
  for (std::sregex_iterator at(text.begin(), text.end(), line), end; at != end; ++at)
    value = (*at)[2];
  return value;
}

// Bit rate that systemd-networkd gives an interface [bit/s]; 0: it manages the interface not at
// all, or without a rate.
std::int64_t WantedBitRate(const Machine& machine, std::int64_t interface_index) {
  const std::string state = ReadFile(machine.network_links / std::to_string(interface_index));
  const fs::path file = LastValue(state, "NETWORK_FILE");
  if (file.empty()) return 0;
  std::map<std::string, fs::path> drop_ins;  // by name, in the order in which they are read
  for (const fs::path& dir : machine.network_dirs) {
    std::error_code missing;
    for (const auto& entry :
         fs::directory_iterator(dir / (file.filename().string() + ".d"), missing))
      if (entry.path().extension() == ".conf")
        drop_ins.try_emplace(entry.path().filename().string(), entry.path());
  }
  std::string text = ReadFile(file);
  for (const auto& [name, path] : drop_ins) text += "\n" + ReadFile(path);
  return BitRateOf(LastValue(text, "BitRate"));
}

Finding BitRateFinding(const std::string& name, std::int64_t rate, std::int64_t wanted) {
  if (rate == 0)
    return Ok("can_bit_rate", "CAN " + name + ": without a bit rate (no controller, such as vcan)");
  const std::string is = "CAN " + name + ": " + std::to_string(rate) + " bit/s";
  if (wanted == 0 || wanted == rate) return Ok("can_bit_rate", is);
  return Error("can_bit_rate",
               is + ", where its .network file says " + std::to_string(wanted),
               "Set the rate of the devices: sudo ip link set " + name +
                   " down, then sudo ip link set " + name + " up type can bitrate " +
                   std::to_string(wanted) + " restart-ms 100; or mend the .network file.");
}

// LCM's multicast group; nothing if the URL has none.
std::optional<std::string> GroupOf(const std::string& lcm_url) {
  std::smatch group;
  if (!std::regex_search(lcm_url, group, std::regex("^udpm://([0-9.]+)"))) return std::nullopt;
  return group[1].str();
}

std::set<std::string> WordsOf(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

// denies: the unit refuses what it does not allow. lets_in: other addresses that it allows, each
// after a space.
Finding FilterFinding(const Machine& machine,
                      const std::string& process,
                      const std::string& cgroup,
                      bool denies,
                      const std::string& lets_in) {
  const std::string name = "IP filter of " + process;
  const std::string remedy =
      "The unit needs IPAddressDeny=any and IPAddressAllow=localhost 239.255.76.67, and no more in "
      "a drop-in (systemctl cat seastitch-" +
      process + "), the kernel CONFIG_CGROUP_BPF.";
  if (cgroup.empty())
    return Warning("ip_filter",
                   name + ": not known, seastitch-" + process + ".service does not run",
                   "sudo systemctl start seastitch.target");
  const FilterState state = machine.filter(machine.cgroups / cgroup.substr(1));
  if (!state.trouble.empty())
    return Warning("ip_filter",
                   name + ": not known, " + state.trouble,
                   "Run the doctor with sudo; the kernel needs CONFIG_CGROUP_BPF.");
  if (!denies || state.programs == 0)
    return Error("ip_filter", name + ": none, so that other computers can speak on LCM", remedy);
  if (!lets_in.empty())
    return Error("ip_filter",
                 name + ": lets other computers speak on LCM, IPAddressAllow has" + lets_in,
                 remedy);
  return Ok("ip_filter", name + ": holds");
}

// network: "10.0.0.0/24", as systemctl prints it.
bool IsWithin(in_addr address, const std::string& network) {
  const std::size_t slash = network.find('/');
  in_addr base{};
  if (slash == std::string::npos ||
      inet_pton(AF_INET, network.substr(0, slash).c_str(), &base) != 1)
    return false;
  const int bits = std::clamp(std::atoi(network.c_str() + slash + 1), 0, 32);
  const std::uint32_t mask = bits == 0 ? 0 : ~std::uint32_t{0} << (32 - bits);
  return ((ntohl(address.s_addr) ^ ntohl(base.s_addr)) & mask) == 0;
}

double MegabytesIn(const std::string& meminfo, const std::string& key) {
  std::smatch value;
  const std::regex pattern("(^|\n)" + key + ":\\s*([0-9]+) kB");
  return std::regex_search(meminfo, value, pattern) ? std::stod(value[2]) / 1024.0 : 0.0;
}

// The running processes that are known to discipline a clock.
std::string Disciplines(const Machine& machine) {
  const std::set<std::string> known{
      "chronyd", "ntpd", "openntpd", "systemd-timesyn", "ptp4l", "phc2sys", "timemaster"};
  std::set<std::string> running;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(machine.proc, missing)) {
    std::string name = ReadFile(entry.path() / "comm");
    name = name.substr(0, name.find('\n'));
    if (known.contains(name))
      running.insert(name == "systemd-timesyn" ? "systemd-timesyncd" : name);
  }
  std::string text;
  for (const std::string& name : running) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

Findings CheckRoute(const Machine& machine, const std::string& lcm_url) {
  const std::optional<std::string> group = GroupOf(lcm_url);
  if (!group)
    return {Ok("lcm_route", "LCM at " + lcm_url + ": not a multicast group, no route is needed")};
  const std::string remedy = "sudo systemctl start lcm-loopback, which does: ip route replace " +
                             *group + "/32 dev lo src 127.0.0.1";
  const std::string name = "route of LCM's group " + *group;
  const std::optional<Json> route = AskIp(machine, {"route", "get", *group});
  if (!route) return {Error("lcm_route", name + ": none", remedy)};
  const std::string dev = StringIn(*route, "dev");
  const std::string source = StringIn(*route, "prefsrc");
  const std::string is = name + ": by " + dev + (source.empty() ? "" : ", source " + source);
  if (dev != "lo")
    return {Error("lcm_route", is + ": what the processes say leaves the computer", remedy)};
  if (!source.empty() && source != "127.0.0.1")  // empty: there is only one
    return {Error("lcm_route", is + ": the processes' IP filters refuse it", remedy)};
  return {Ok("lcm_route", is)};
}

Findings CheckCan(const Machine& machine, const std::string& interface) {
  const std::string name = "CAN " + interface;
  const std::string bring_up = "sudo ip link set " + interface +
                               " up type can bitrate RATE restart-ms 100, or sudo "
                               "systemctl enable --now systemd-networkd";
  const auto link = AskIp(machine, {"-details", "link", "show", "dev", interface});
  if (!link)
    return {Error("can_interface",
                  name + ": no such interface",
                  "Check the adapter, its driver (dmesg), and the source of the drivers.")};
  const Json flags = link->value("flags", Json::array());
  if (std::find(flags.begin(), flags.end(), "UP") == flags.end())
    return {Error("can_interface", name + ": down", bring_up)};
  const Json info = link->value("linkinfo", Json::object());
  const Json data = info.value("info_data", Json::object());
  const std::string state = StringIn(data, "state");
  Findings findings;
  if (state.empty() || state == "ERROR-ACTIVE")
    findings.push_back(Ok("can_interface", name + ": up" + (state.empty() ? "" : ", " + state)));
  else
    findings.push_back(Error("can_interface",
                             name + ": up, controller " + state,
                             "Check bit rate, termination and wiring, and that a device answers."));
  const Json timing = data.value("bittiming", Json::object());
  const Json rate = timing.value("bitrate", Json(0));
  findings.push_back(
      BitRateFinding(interface,
                     rate.is_number_integer() ? rate.get<std::int64_t>() : 0,
                     WantedBitRate(machine, link->value("ifindex", std::int64_t{0}))));
  return findings;
}

Findings CheckBuffers(const Machine& machine, std::int64_t wanted_bytes) {
  const std::string text = ReadFile(machine.proc / "sys/net/core/rmem_max");
  if (text.empty())
    return {Ok("socket_buffers", "receive buffers: the limit is not to be seen in this namespace")};
  const std::int64_t granted = std::atoll(text.c_str());
  const std::string is = "receive buffers: at most " + std::to_string(granted) + " bytes";
  if (granted >= wanted_bytes) return {Ok("socket_buffers", is)};
  return {Error("socket_buffers",
                is + ", where a process asks for " + std::to_string(wanted_bytes) +
                    ": a burst of the sonar is lost",
                "sudo sysctl net.core.rmem_max=" + std::to_string(wanted_bytes) +
                    "; for ever: sysctl.d/60-seastitch.conf")};
}

Findings CheckPort(const std::string& driver, const std::string& source) {
  const HostPort address = HostPortOf(ParseSourceUrl(source, {"interface", "from"}));
  const std::string name = "UDP port " + std::to_string(address.port) + " of " + driver;
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_port = htons(address.port);
  // not a number but a host's name
  if (inet_pton(AF_INET, address.host.c_str(), &local.sin_addr) != 1) return {};
  const FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&local), sizeof local) == 0)
    return {Ok("udp_port", name + ": free")};
  const int error = errno;
  return {Error("udp_port",
                name + ": " + std::strerror(error),
                error == EADDRINUSE
                    ? "End the program that holds it (sudo ss -ulpn), or change the source."
                    : "The source must name an address of this computer, or 0.0.0.0.")};
}

Findings CheckOutputFilter(const Machine& machine, const std::string& udp) {
  const std::string host = HostPortOf(ParseSourceUrl(udp, {"interface"})).host;
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1) return {};  // a host's name
  const std::string unit = "seastitch-nav-output.service";
  auto shown = ShowUnits(machine, {unit}, "IPAddressAllow,IPAddressDeny")[unit];
  const std::set<std::string> allowed = WordsOf(shown["IPAddressAllow"]);
  const std::string name = "output of nav-output: ";
  if (!WordsOf(shown["IPAddressDeny"]).contains("0.0.0.0/0") ||
      std::any_of(allowed.begin(), allowed.end(), [&](const std::string& network) {
        return IsWithin(address, network);
      }))
    return {Ok("output_filter", name + "its unit may send to " + host)};
  return {Error("output_filter",
                name + "its unit may not send to " + host,
                "sudo systemctl edit seastitch-nav-output, with [Service] and IPAddressAllow=" +
                    host + "; then sudo systemctl restart seastitch-nav-output.")};
}

Findings CheckPage(const std::string& listen) {
  const std::string name = "page: listens at " + listen;
  if (IsLoopback(ParseListenAddress(listen)))
    return {Ok("page_address", name + ", which only this computer reaches")};
  return {Warning("page_address",
                  name + ": whoever reaches this computer by network sees the survey",
                  "Listen at 127.0.0.1 and use ssh -L (docs/operations.md). Where the network is "
                  "trusted, the unit needs IPAddressAllow with the browsers' addresses too.")};
}

Findings CheckSerial(const std::string& driver, const std::string& source) {
  const std::string device = ParseSourceUrl(source, {"baud"}).address;
  const std::string name = "serial port " + device + " of " + driver;
  std::error_code error;
  if (std::filesystem::is_character_file(device, error))
    return {Ok("serial_port", name + ": is there")};
  return {Error("serial_port",
                name + ": " + (error ? error.message() : "is not a device"),
                "Plug it in, or change the source; by-id names of /dev/serial/by-id stay.")};
}

Findings CheckClock(const Machine& machine) {
  const ClockState state = machine.clock();
  const std::string by = Disciplines(machine);
  const std::string remedy =
      "Start chrony (or ptp4l with phc2sys) and wait until it is synchronised: the sensors' "
      "stamps and ours drift apart.";
  if (!state.synchronised)
    return {Warning("clock",
                    by.empty() ? "clock: runs free, nobody disciplines it"
                               : "clock: not synchronised yet by " + by,
                    remedy)};
  const std::string is = "clock: synchronised by " + (by.empty() ? "a program unknown here" : by) +
                         Format(", within %.3f s", state.error_s);
  constexpr double kGoodS = 0.5;
  if (state.error_s > kGoodS) return {Warning("clock", is, remedy)};
  return {Ok("clock", is)};
}

Findings CheckProcessor(const Machine& machine) {
  const double load = std::atof(ReadFile(machine.proc / "loadavg").c_str());
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  const std::string is = Format("CPU: %u cores, load %.1f", cores, load);
  if (load <= cores) return {Ok("cpu", is)};
  return {Warning("cpu", is, "End what else runs (top): messages wait, and may be lost.")};
}

Findings CheckMemory(const Machine& machine) {
  const std::string info = ReadFile(machine.proc / "meminfo");
  const double free_mb = MegabytesIn(info, "MemAvailable");
  const std::string is =
      Format("memory: %.0f of %.0f MB available", free_mb, MegabytesIn(info, "MemTotal"));
  constexpr double kMustMb = 128.0;
  constexpr double kShouldMb = 384.0;  // enough for a survey of hours: docs/performance.md
  if (free_mb >= kShouldMb) return {Ok("memory", is)};
  const std::string remedy = "End what else runs (top), or restart the computer.";
  if (free_mb < kMustMb) return {Error("memory", is, remedy)};
  return {Warning("memory", is, remedy)};
}

Findings CheckFilter(const Machine& machine, const std::string& lcm_url) {
  const std::set<std::string> permitted{
      "127.0.0.0/8", "::1/128", GroupOf(lcm_url).value_or("239.255.76.67") + "/32"};
  const auto unit_of = [](const std::string& process) {
    return "seastitch-" + process + ".service";
  };
  const std::vector<std::string> processes{"mapper", "optimizer", "logger"};
  // What a slice lets in, its units receive too.
  const std::vector<std::string> slices{"-.slice", "system.slice"};
  std::vector<std::string> names = slices;
  for (const std::string& process : processes) names.push_back(unit_of(process));
  UnitProperties units = ShowUnits(machine, names, "ControlGroup,IPAddressAllow,IPAddressDeny");
  std::string of_slices;
  for (const std::string& slice : slices) of_slices += units[slice]["IPAddressAllow"] + " ";
  Findings findings;
  for (const std::string& process : processes) {
    auto& unit = units[unit_of(process)];
    std::string lets_in;
    for (const std::string& address : WordsOf(of_slices + unit["IPAddressAllow"]))
      if (!permitted.contains(address)) lets_in += " " + address;
    findings.push_back(FilterFinding(machine,
                                     process,
                                     unit["ControlGroup"],
                                     WordsOf(unit["IPAddressDeny"]).contains("0.0.0.0/0"),
                                     lets_in));
  }
  return findings;
}

}  // namespace seastitch
