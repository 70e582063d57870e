#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "codecs/kongsberg/em_all.hpp"
#include "codecs/kongsberg/receiver_roll.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

// Installation datagrams (I) of .all files.
namespace seastitch {
namespace {

constexpr std::uint16_t kEm2040 = 2040;
constexpr std::uint16_t kEm2040C = 2045;
constexpr std::uint16_t kEm3020 = 3020;

using Values = std::map<std::string, std::string>;

Eigen::Vector3d Place(const Values& values, const std::string& prefix) {
  return {NumberOr0(values, prefix + "X"),
          NumberOr0(values, prefix + "Y"),
          NumberOr0(values, prefix + "Z")};
}

Eigen::Isometry3d Mounting(const Values& values, const std::string& prefix) {
  return MakePose(Place(values, prefix),
                  RotationFromRpy(Deg2Rad(NumberOr0(values, prefix + "R")),
                                  Deg2Rad(NumberOr0(values, prefix + "P")),
                                  Deg2Rad(NumberOr0(values, prefix + "H"))));
}

Eigen::Isometry3d MountingOfReceiver(const Values& values, const std::string& prefix) {
  const double pitch_rad = Deg2Rad(NumberOr0(values, prefix + "P"));
  const double roll_rad = RollOfReceiver(Deg2Rad(NumberOr0(values, prefix + "R")), pitch_rad);
  return MakePose(Place(values, prefix),
                  RotationFromRpy(roll_rad, pitch_rad, Deg2Rad(NumberOr0(values, prefix + "H"))));
}

// Positions of the arrays in their housings [m]. EM 2040C: the receiver position that reproduces
// the maker's own soundings; the manual exchanges x and y.
std::vector<Eigen::Vector3d> TransmitCentres(int model) {
  if (model == kEm2040)
    return {{0.0, -0.0554, -0.012}, {0.0, 0.01315, -0.006}, {0.0, 0.0554, -0.012}};
  if (model == kEm2040C) return {{0.0038, 0.04, -0.006}};
  return {Eigen::Vector3d::Zero()};
}
std::vector<Eigen::Vector3d> ReceiveCentres(int model) {
  if (model == kEm2040) return {{0.011, 0.0, -0.006}};
  if (model == kEm2040C) return {{0.0, -0.0455, -0.006}};
  return {Eigen::Vector3d::Zero()};
}

// Number of the transducer configuration ("S0" to "S3" below); files before 2013 do not state it.
int TransducerConfiguration(const Values& values, int model) {
  constexpr double kMost = 100.0;
  if (values.contains("STC"))
    return static_cast<int>(std::clamp(NumberOr0(values, "STC"), -1.0, kMost));
  if (model != kEm2040C && model != kEm3020) return 0;
  return values.contains("S2X") ? 2 : 1;
}

void AddArrays(int model, SonarInstallation* out) {
  using Names = std::vector<std::string>;
  const std::array<std::pair<Names, Names>, 5> kConfigurations{{
      {{"S1"}, {"S2"}},              // transmitter and receiver
      {{"S1"}, {"S1"}},              // one head
      {{"S1", "S2"}, {"S1", "S2"}},  // two heads
      {{"S1"}, {"S2", "S3"}},        // two receivers
      {{"S0", "S1"}, {"S2", "S3"}},  // two of each
  }};
  const int number = TransducerConfiguration(out->values, model);
  if (number < 0 || number >= static_cast<int>(kConfigurations.size())) return;
  const auto& [transmitters, receivers] = kConfigurations[static_cast<std::size_t>(number)];
  for (const std::string& name : transmitters)
    out->transmitters.push_back({Mounting(out->values, name), TransmitCentres(model)});
  for (const std::string& name : receivers) {
    const bool in_one_head = transmitters == receivers;
    out->receivers.push_back(
        {in_one_head ? Mounting(out->values, name) : MountingOfReceiver(out->values, name),
         ReceiveCentres(model)});
  }
}

void AddSensors(SonarInstallation* out) {
  const Values& values = out->values;
  const int active = static_cast<int>(std::clamp(NumberOr0(values, "APS"), 0.0, 2.0)) + 1;
  for (int i = 1; i <= 3; ++i) {
    const std::string name = "P" + std::to_string(i);
    out->sensors.push_back({name,
                            i == active,
                            Eigen::Isometry3d(Eigen::Translation3d(Place(values, name))),
                            NumberOr0(values, name + "D"),
                            true});
  }
  const double attitude = NumberOr0(values, "ARO");
  constexpr double kToNetwork = 6.0;  // from the number of a serial port to that of the network
  for (const auto& [name, number] : {std::pair{"MS", 2.0}, std::pair{"NS", 3.0}})
    out->sensors.push_back({name,
                            attitude == number || attitude == number + kToNetwork,
                            Eigen::Isometry3d(Eigen::Translation3d(Place(values, name))),
                            NumberOr0(values, std::string(name) + "D") / 1000.0,
                            true});
}

}  // namespace

std::optional<SonarInstallation> DecodeEmI(const EmDatagram& datagram) {
  if (datagram.body.size() < 2) return std::nullopt;
  const std::string text =
      TextFromBytes(datagram.body.subspan(2));  // after the second serial number
  SonarInstallation out;
  out.time = datagram.time;
  out.model = datagram.model == kEm2040C ? "EM 2040C" : "EM " + std::to_string(datagram.model);
  for (const std::string_view item : Split(text, ',')) {
    const std::size_t equals = item.find('=');
    if (equals != std::string_view::npos)
      out.values.emplace(Trimmed(item.substr(0, equals)), Trimmed(item.substr(equals + 1)));
  }
  if (const auto serial = out.values.find("SMH"); serial != out.values.end())
    out.serial = serial->second;
  out.water_line_m = NumberOr0(out.values, "WLZ");
  AddArrays(datagram.model, &out);
  AddSensors(&out);
  return out;
}

Eigen::Vector3d EmSoundingOrigin(const SonarInstallation& installation) {
  Eigen::Vector3d origin(0.0, 0.0, installation.water_line_m);
  for (const InstalledSensor& sensor : installation.sensors)
    if (sensor.active && sensor.name.starts_with('P'))
      origin.head<2>() = sensor.T_vehicle_sensor.translation().head<2>();
  return origin;
}

}  // namespace seastitch
