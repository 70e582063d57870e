#include "bench/fault.hpp"

#include <sstream>
#include <stdexcept>

namespace seastitch::bench {
namespace {

double Number(const std::string& text) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size())
    throw std::invalid_argument("'" + text + "' is not a number");
  return value;
}

void Set(const std::string& key, const std::string& value, Fault* fault) {
  if (key == "from_s")
    fault->from_s = Number(value);
  else if (key == "to_s")
    fault->to_s = Number(value);
  else if (key == "rate")
    fault->rate = Number(value);
  else if (key == "device")
    fault->device = DeviceFrom(value);
  else
    throw std::invalid_argument("'" + key + "': expected from_s, to_s, device or rate");
}

Fault Parse(const std::string& text) {
  const std::size_t colon = text.find(':');
  Fault fault;
  fault.kind = FaultKindFrom(text.substr(0, colon));
  if (colon == std::string::npos) return fault;
  std::istringstream list(text.substr(colon + 1));
  for (std::string item; std::getline(list, item, ',');) {
    const std::size_t equals = item.find('=');
    if (equals == std::string::npos)
      throw std::invalid_argument("'" + item + "': expected key=value");
    Set(item.substr(0, equals), item.substr(equals + 1), &fault);
  }
  return fault;
}

}  // namespace

FaultKind FaultKindFrom(const std::string& name) {
  if (name == "dvl_dropout") return FaultKind::kDvlDropout;
  if (name == "packet_loss") return FaultKind::kPacketLoss;
  throw std::invalid_argument("'" + name + "': expected dvl_dropout or packet_loss");
}

Device DeviceFrom(const std::string& name) {
  if (name == "imu") return Device::kImu;
  if (name == "dvl") return Device::kDvl;
  if (name == "mbes") return Device::kMbes;
  throw std::invalid_argument("'" + name + "': expected imu, dvl or mbes");
}

Fault ParseFault(const std::string& text) {
  try {
    const Fault fault = Parse(text);
    if (const std::string problem = fault.Validate(); !problem.empty())
      throw std::invalid_argument(problem);
    return fault;
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument("fault '" + text + "': " + e.what());
  }
}

std::string Fault::Validate() const {
  if (!(from_s >= 0.0)) return "from_s must not be negative";
  if (!(to_s > from_s)) return "to_s must be above from_s";
  if (!(rate >= 0.0 && rate <= 1.0)) return "rate must be 0 to 1";
  return "";
}

}  // namespace seastitch::bench
