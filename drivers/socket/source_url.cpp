#include "drivers/socket/source_url.hpp"

#include <net/if.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace seastitch {
namespace {

constexpr char kCanUrls[] = "can:INTERFACE, candump:FILE or udp:HOST:PORT";
constexpr char kDatagramUrls[] = "udp:HOST:PORT";
constexpr char kStreamUrls[] = "tcp:HOST:PORT";
constexpr char kByteUrls[] = "udp:HOST:PORT, tcp:HOST:PORT or serial:/dev/NAME";
constexpr int kBauds[] = {
    1200, 2400, 4800, 9600, 19'200, 38'400, 57'600, 115'200, 230'400, 460'800, 921'600};

void ExpectInterface(const SourceUrl& url, const std::string& name) {
  if (name.empty() || name.size() >= IFNAMSIZ || name.find_first_of("/ \t") != std::string::npos)
    throw std::runtime_error(url.text + ": '" + name + "' is not the name of an interface, 1 to " +
                             std::to_string(IFNAMSIZ - 1) + " letters");
}

void ExpectUdp(const std::string& text) {
  const SourceUrl url = ParseSourceUrl(text, {"interface", "from"});
  HostPortOf(url);
  if (url.options.contains("interface")) ExpectInterface(url, url.options.at("interface"));
  GateOf(url);
}

void ExpectCandump(const std::string& text) {
  const SourceUrl url = ParseSourceUrl(text, {"speed"});
  SpeedOf(url);
  if (!std::filesystem::exists(url.address) || std::filesystem::is_directory(url.address))
    throw std::runtime_error(text + ": not a file that can be read");
}

void ExpectSerial(const std::string& text) {
  const SourceUrl url = ParseSourceUrl(text, {"baud"});
  BaudOf(url);
  if (!url.address.starts_with("/")) throw std::runtime_error(text + ": expected serial:/dev/NAME");
}

const char* UrlsOf(SourceKind kind) {
  switch (kind) {
    case SourceKind::kCan: return kCanUrls;
    case SourceKind::kDatagrams: return kDatagramUrls;
    case SourceKind::kStream: return kStreamUrls;
    case SourceKind::kBytes: return kByteUrls;
  }
  return "";
}

}  // namespace

SourceUrl ParseSourceUrl(const std::string& text, const std::set<std::string>& allowed_options) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos)
    throw std::runtime_error(text +
                             ": expected can:INTERFACE, candump:FILE, serial:/dev/NAME, "
                             "tcp:HOST:PORT or udp:HOST:PORT");
  const std::size_t mark = text.find('?', colon);
  SourceUrl url;
  url.text = text;
  url.scheme = text.substr(0, colon);
  url.address = text.substr(colon + 1, mark == std::string::npos ? mark : mark - colon - 1);
  if (mark == std::string::npos) return url;
  std::istringstream options(text.substr(mark + 1));
  for (std::string option; std::getline(options, option, '&');) {
    const std::size_t equals = option.find('=');
    const std::string key = option.substr(0, equals);
    if (equals == std::string::npos || !allowed_options.contains(key))
      throw std::runtime_error(text + ": unknown option '" + option + "'");
    url.options[key] = option.substr(equals + 1);
  }
  return url;
}

HostPort HostPortOf(const SourceUrl& url) {
  const std::size_t colon = url.address.rfind(':');
  if (colon == std::string::npos || colon == 0)
    throw std::runtime_error(url.text + ": expected " + url.scheme + ":HOST:PORT");
  const std::string text = url.address.substr(colon + 1);
  HostPort address{url.address.substr(0, colon), 0};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, address.port);
  if (error != std::errc() || stop != end || address.port == 0)
    throw std::runtime_error(url.text + ": '" + text + "' is not a port, 1 to 65535");
  return address;
}

double SpeedOf(const SourceUrl& url) {
  const std::string text = url.Option("speed", "1");
  double speed = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, speed);
  if (error != std::errc() || stop != end || !std::isfinite(speed) || speed < 0.0)
    throw std::runtime_error(url.text + ": speed '" + text + "' is not a number from 0 up");
  return speed;
}

int BaudOf(const SourceUrl& url) {
  const std::string text = url.Option("baud", "4800");
  for (const int baud : kBauds)
    if (text == std::to_string(baud)) return baud;
  throw std::runtime_error(url.text + ": '" + text + "' is not a rate of a serial port, 1200 to " +
                           std::to_string(*std::rbegin(kBauds)) + " baud");
}

SenderGate GateOf(const SourceUrl& url) {
  if (!url.options.contains("from")) return SenderGate();
  try {
    return SenderGate(url.options.at("from"));
  } catch (const std::runtime_error& e) {
    throw std::runtime_error(url.text + ": from: " + e.what());
  }
}

void ExpectUsable(const std::string& text, SourceKind kind) {
  const SourceUrl url = ParseSourceUrl(text, {"speed", "interface", "from", "baud"});
  const bool is_can = kind == SourceKind::kCan;
  const bool may_be_tcp = kind == SourceKind::kStream || kind == SourceKind::kBytes;
  if (url.scheme == "udp" && kind != SourceKind::kStream) {
    ExpectUdp(text);
  } else if (url.scheme == "tcp" && may_be_tcp) {
    HostPortOf(ParseSourceUrl(text, {}));
  } else if (is_can && url.scheme == "candump") {
    ExpectCandump(text);
  } else if (is_can && url.scheme == "can") {
    ExpectInterface(ParseSourceUrl(text, {}), url.address);
  } else if (kind == SourceKind::kBytes && url.scheme == "serial") {
    ExpectSerial(text);
  } else {
    throw std::runtime_error(text + ": expected " + UrlsOf(kind));
  }
}

}  // namespace seastitch
