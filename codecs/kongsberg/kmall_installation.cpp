#include <cstdio>
#include <map>
#include <string>
#include <string_view>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/kongsberg/receiver_roll.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

// Installation (#IIP) and settings (#IOP) of .kmall files.
namespace seastitch {
namespace {

constexpr std::size_t kTextAt = 26;

std::optional<std::string> TextOf(Bytes datagram, std::string_view type) {
  const std::optional<Bytes> body = WholeKmall(datagram, type);
  if (!body || body->size() < kTextAt) return std::nullopt;
  return TextFromBytes(body->subspan(kTextAt));
}

using Values = std::map<std::string, std::string>;

Eigen::Vector3d Vector(const Values& item,
                       const std::string& x,
                       const std::string& y,
                       const std::string& z) {
  return {NumberOr0(item, x), NumberOr0(item, y), NumberOr0(item, z)};
}

Eigen::Isometry3d Mounting(const Values& item) {
  const Eigen::Vector3d rpy_rad = Vector(item, "R", "P", "H") * Deg2Rad(1.0);
  return MakePose(Vector(item, "X", "Y", "Z"),
                  RotationFromRpy(rpy_rad.x(), rpy_rad.y(), rpy_rad.z()));
}

// A transmitter with one acoustic centre, or with those of its port, centre and starboard part, in
// the order of txSubArray.
InstalledArray Transmitter(const Values& item) {
  if (!item.contains("IPX")) return {Mounting(item), {Vector(item, "ITX", "ITY", "ITZ")}};
  return {Mounting(item),
          {Vector(item, "IPX", "IPY", "IPZ"),
           Vector(item, "ICX", "ICY", "ICZ"),
           Vector(item, "ISX", "ISY", "ISZ")}};
}

InstalledArray Receiver(const Values& item, const std::string& centre) {
  const Eigen::Vector3d rpy_rad = Vector(item, "R", "P", "H") * Deg2Rad(1.0);
  const double roll_rad = RollOfReceiver(rpy_rad.x(), rpy_rad.y());
  return {
      MakePose(Vector(item, "X", "Y", "Z"), RotationFromRpy(roll_rad, rpy_rad.y(), rpy_rad.z())),
      {Vector(item, centre + "X", centre + "Y", centre + "Z")}};
}

// "X=1.0;Y=2.0" to {X: 1.0, Y: 2.0}.
Values Pairs(std::string_view text) {
  Values values;
  for (const std::string_view pair : Split(text, ';')) {
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos)
      values.emplace(Trimmed(pair.substr(0, equals)), Trimmed(pair.substr(equals + 1)));
  }
  return values;
}

void AddItem(const std::string& name, const Values& item, SonarInstallation* out) {
  if (name.starts_with("TRAI_") && out->serial.empty())
    if (const auto serial = item.find("N"); serial != item.end()) out->serial = serial->second;
  if (name.starts_with("TRAI_TX")) {
    out->transmitters.push_back(Transmitter(item));
  } else if (name.starts_with("TRAI_RX")) {
    out->receivers.push_back(Receiver(item, "I"));
  } else if (name.starts_with("TRAI_HD")) {
    out->transmitters.push_back(Transmitter(item));
    out->receivers.push_back(Receiver(item, "IR"));
  } else if (name == "EMXI") {
    out->water_line_m = NumberOr0(item, "SWLZ");
  } else if (name.starts_with("POSI_") || name.starts_with("ATTI_")) {
    const auto use = item.find("U");
    if (use == item.end() || use->second == "NOT_SET") return;
    out->sensors.push_back(
        {name, use->second == "ACTIVE", Mounting(item), NumberOr0(item, "D"), true});
  }
}

std::string Fixed(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6f", value);
  return text;
}

}  // namespace

std::optional<SonarInstallation> DecodeIip(Bytes datagram) {
  const std::optional<std::string> text = TextOf(datagram, "#IIP");
  if (!text) return std::nullopt;
  SonarInstallation out;
  const KmallHeader header = *ReadKmallHeader(datagram);
  out.time = header.time();
  out.model = "EM " + std::to_string(header.echo_sounder_id);
  for (const std::string_view part : Split(*text, ',')) {
    const std::string_view item = Trimmed(part);
    const std::size_t colon = item.find_first_of(":=");
    if (colon == std::string_view::npos) continue;
    const std::string name(item.substr(0, colon));
    const std::string_view rest = item.substr(colon + 1);
    out.values.emplace(name, rest);
    AddItem(name, Pairs(rest), &out);
  }
  return out;
}

std::optional<SonarSettings> DecodeIop(Bytes datagram) {
  const std::optional<std::string> text = TextOf(datagram, "#IOP");
  if (!text) return std::nullopt;
  SonarSettings out{ReadKmallHeader(datagram)->time(), {}};
  for (const std::string_view line : Split(*text, '\n')) {
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos)
      out.values.emplace(Trimmed(line.substr(0, colon)), Trimmed(line.substr(colon + 1)));
  }
  return out;
}

std::vector<std::uint8_t> EncodeIip(const SonarInstallation& installation,
                                    const KmallHeader& header) {
  std::string text = "EMXI:SWLZ=" + Fixed(installation.water_line_m) + ";,";
  const auto add = [&text](
                       const std::string& name, const Eigen::Isometry3d& pose, const char* use) {
    const Eigen::Vector3d& p = pose.translation();
    Eigen::Vector3d rpy = RpyFromRotation(pose.linear());
    if (name == "TRAI_RX1") rpy.x() = InclinationOfReceiver(rpy.x(), rpy.y());
    rpy *= 180.0 / kPi;
    text += name + ":X=" + Fixed(p.x()) + ";Y=" + Fixed(p.y()) + ";Z=" + Fixed(p.z()) +
            ";R=" + Fixed(rpy.x()) + ";P=" + Fixed(rpy.y()) + ";H=" + Fixed(rpy.z()) + ";D=0.000;" +
            use + ",";
  };
  add("TRAI_TX1", installation.TransmitterOf(0)->At(0), "");
  add("TRAI_RX1", installation.ReceiverOf(0)->At(0), "");
  const auto place = [&installation](std::size_t i) {
    return i < installation.sensors.size() ? installation.sensors[i].T_vehicle_sensor
                                           : Eigen::Isometry3d::Identity();
  };
  add("POSI_1", place(0), "U=ACTIVE");
  add("ATTI_1", place(1), "U=ACTIVE");
  KmallHeader iip = header;
  iip.type = {'#', 'I', 'I', 'P'};
  iip.version = 0;
  ByteWriter out;
  WriteKmallHeader(iip, installation.time, &out);
  out.Le(static_cast<std::uint16_t>(text.size() + 6));
  out.Zeros(4);  // info, status
  for (const char c : text) out.Le(static_cast<std::uint8_t>(c));
  return SealKmall(&out);
}

}  // namespace seastitch
