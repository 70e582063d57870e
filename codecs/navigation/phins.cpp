#include "codecs/navigation/phins.hpp"

#include <array>
#include <cmath>
#include <numeric>

#include "codecs/calendar.hpp"
#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kChecksumBytes = 4;
constexpr std::int64_t kUsPerTick = 100;
constexpr std::size_t kLongest = 2048;  // above the sum of all blocks

// Size of each block by its bit [bytes]; 0: the block is not documented.
constexpr std::array<std::uint8_t, 32> kNavigation{12, 12, 16, 8,  12, 12, 12, 21, 16, 12, 12,
                                                   8,  8,  4,  8,  16, 12, 4,  4,  12, 4,  12,
                                                   12, 12, 8,  12, 16, 12, 12, 12, 12, 0};
constexpr std::array<std::uint8_t, 32> kExtended{12, 12, 12, 12, 12, 21, 16};
constexpr std::array<std::uint8_t, 32> kExternal{5,  46, 46, 46, 13, 13, 49, 49, 49, 12,
                                                 37, 33, 8,  8,  41, 41, 41, 41, 9,  9,
                                                 9,  37, 33, 0,  16, 17, 17, 12};
enum NavigationBlock : std::size_t {
  kAttitude = 0,
  kAttitudeSigma = 1,
  kPosition = 7,
  kPositionSigma = 8,
  kVelocity = 9,
  kVelocitySigma = 10,
  kDate = 13,
  kUserStatus = 17,
};
constexpr std::size_t kExternalDepth = 9;

struct Header {
  int version = 0;
  std::uint32_t navigation = 0, extended = 0, external = 0;
  std::size_t total_bytes = 0;
  std::uint32_t valid_at_ticks = 0;
  std::uint32_t counter = 0;
};

std::optional<Header> ReadHeader(ByteReader* in) {
  Header header;
  in->Skip(2);
  header.version = in->Be<std::uint8_t>();
  header.navigation = in->Be<std::uint32_t>();
  if (header.version >= 3) header.extended = in->Be<std::uint32_t>();
  header.external = in->Be<std::uint32_t>();
  if (header.version >= 4) in->Skip(2);
  header.total_bytes = in->Be<std::uint16_t>();
  header.valid_at_ticks = in->Be<std::uint32_t>();
  header.counter = in->Be<std::uint32_t>();
  return in->ok() ? std::optional(header) : std::nullopt;
}

Eigen::Vector3d ReadVector(ByteReader* in) {
  Eigen::Vector3d v;
  for (double& value : v) value = in->Be<float>();
  return v;
}

// Heading, roll, pitch. The INS sends pitch positive bow down.
void ReadAttitude(ByteReader* in, PhinsFrame* frame) {
  const Eigen::Vector3d heading_roll_pitch_deg = ReadVector(in);
  if (!heading_roll_pitch_deg.allFinite()) return;
  frame->attitude = AttitudeFromDegrees(
      heading_roll_pitch_deg[1], -heading_roll_pitch_deg[2], heading_roll_pitch_deg[0]);
}

bool AreSigmas(const Eigen::Vector3d& v) { return v.allFinite() && v.minCoeff() >= 0.0; }

void ReadPosition(ByteReader* in, PhinsFrame* frame) {
  const auto latitude_deg = in->Be<double>();
  auto longitude_deg = in->Be<double>();
  frame->altitude_is_above_ellipsoid = in->Be<std::uint8_t>() == 1;
  const double altitude_m = in->Be<float>();
  if (longitude_deg > 180.0) longitude_deg -= 360.0;
  if (!(std::abs(latitude_deg) <= 90.0) || !(std::abs(longitude_deg) <= 180.0)) return;
  frame->position = GeoPosition{Deg2Rad(latitude_deg), Deg2Rad(longitude_deg)};
  if (std::isfinite(altitude_m)) frame->altitude_m = altitude_m;
}

void ReadPositionSigma(ByteReader* in, PhinsFrame* frame) {
  const double north_m = in->Be<float>();
  const double east_m = in->Be<float>();
  in->Skip(4);  // correlation
  const double altitude_m = in->Be<float>();
  if (!AreSigmas({north_m, east_m, altitude_m})) return;
  if (frame->position) frame->position->sigma_north_east_m = {north_m, east_m};
  frame->sigma_altitude_m = altitude_m;
}

void ReadVelocity(ByteReader* in, PhinsFrame* frame) {
  const Eigen::Vector3d north_east_up_mps = ReadVector(in);
  if (!north_east_up_mps.allFinite()) return;
  frame->velocity =
      GeoVelocity{{north_east_up_mps[0], north_east_up_mps[1], -north_east_up_mps[2]}};
}

InsStatus StatusOf(std::uint32_t user_status) {
  const auto has = [user_status](int bit) { return (user_status >> bit & 1) != 0; };
  if (has(31)) return InsStatus::kInvalid;  // failure
  if (has(27))
    return InsStatus::kAligning;  // while it aligns, the INS also reports its attitude as invalid
  if (has(26)) return InsStatus::kInvalid;  // attitude and position are invalid
  return InsStatus::kUnknown;
}

void ReadNavigationBlock(std::size_t block, Bytes bytes, PhinsFrame* frame) {
  ByteReader in(bytes);
  if (block == kAttitude) ReadAttitude(&in, frame);
  if (block == kAttitudeSigma && frame->attitude) {
    const Eigen::Vector3d hrp_deg = ReadVector(&in);
    if (AreSigmas(hrp_deg))
      frame->attitude->sigma_rpy_rad =
          Eigen::Vector3d(hrp_deg[1], hrp_deg[2], hrp_deg[0]) * Deg2Rad(1.0);
  }
  if (block == kPosition) ReadPosition(&in, frame);
  if (block == kPositionSigma) ReadPositionSigma(&in, frame);
  if (block == kVelocity) ReadVelocity(&in, frame);
  if (block == kVelocitySigma && frame->velocity) {
    const Eigen::Vector3d sigma_mps = ReadVector(&in);
    if (AreSigmas(sigma_mps)) frame->velocity->sigma_ned_mps = sigma_mps;
  }
  if (block == kDate) {
    const int day = in.Be<std::uint8_t>();
    const int month = in.Be<std::uint8_t>();
    frame->midnight = Midnight(in.Be<std::uint16_t>(), month, day);
  }
  if (block == kUserStatus) frame->status = StatusOf(in.Be<std::uint32_t>());
}

void ReadExternalDepth(Bytes bytes, PhinsFrame* frame) {
  ByteReader in(bytes);
  const auto at_ticks = in.Be<std::int32_t>();
  const double depth_m = in.Be<float>();
  const double sigma_m = in.Be<float>();
  if (!std::isfinite(depth_m)) return;
  frame->sensor_depth_at = Duration(kUsPerTick * at_ticks);
  frame->sensor_depth = InsVertical{depth_m, sigma_m > 0.0 && std::isfinite(sigma_m) ? sigma_m : 0};
}

// Calls `read` for each block. False if a block is not documented or exceeds the frame.
template <class Read>
bool ReadBlocks(std::uint32_t mask,
                const std::array<std::uint8_t, 32>& sizes,
                ByteReader* in,
                Read read) {
  for (std::size_t block = 0; block < sizes.size(); ++block) {
    if ((mask >> block & 1) == 0) continue;
    const Bytes bytes = in->Take(sizes[block]);
    if (sizes[block] == 0 || !in->ok()) return false;
    read(block, bytes);
  }
  return true;
}

bool IsAnswer(Bytes bytes) { return bytes[0] == 'A'; }

}  // namespace

std::optional<std::size_t> SizeOfPhins(Bytes bytes) {
  constexpr std::size_t kLongestHeader = 27;
  const bool is_ix = bytes[0] == 'I' && (bytes.size() < 2 || bytes[1] == 'X');
  const bool is_an = bytes[0] == 'A' && (bytes.size() < 2 || bytes[1] == 'N');
  if (!is_ix && !is_an) return std::nullopt;
  if (bytes.size() >= 3 && (bytes[2] < 2 || bytes[2] > 5)) return std::nullopt;
  if (bytes.size() < (is_an ? 5 : kLongestHeader)) return 0;
  ByteReader in(bytes);
  std::size_t size = 0;
  if (is_an) {
    in.Skip(3);
    size = in.Be<std::uint16_t>();
    if (size < 5 + kChecksumBytes) return std::nullopt;
  } else {
    size = ReadHeader(&in)->total_bytes;
    if (size < kLongestHeader + kChecksumBytes - 6)
      return std::nullopt;  // header of version 2, 6 bytes shorter
  }
  if (size > kLongest) return std::nullopt;
  if (bytes.size() < size) return 0;
  const Bytes body = bytes.first(size - kChecksumBytes);
  ByteReader tail(bytes.subspan(body.size()));
  const auto sum = std::accumulate(body.begin(), body.end(), std::uint32_t{0});
  return tail.Be<std::uint32_t>() == sum ? std::optional(size) : std::nullopt;
}

std::optional<PhinsFrame> DecodePhins(Bytes bytes) {
  if (bytes.empty() || SizeOfPhins(bytes) != bytes.size()) return std::nullopt;
  PhinsFrame frame;
  if (IsAnswer(bytes)) return frame;
  ByteReader in(bytes.first(bytes.size() - kChecksumBytes));
  const std::optional<Header> header = ReadHeader(&in);
  if (!header) return std::nullopt;
  frame.version = header->version;
  frame.valid_at = Duration(kUsPerTick * header->valid_at_ticks);
  frame.counter = header->counter;
  const auto skip = [](std::size_t, Bytes) {};
  const bool whole =
      ReadBlocks(header->navigation,
                 kNavigation,
                 &in,
                 [&](std::size_t block, Bytes b) { ReadNavigationBlock(block, b, &frame); }) &&
      ReadBlocks(header->extended, kExtended, &in, skip) &&
      ReadBlocks(header->external, kExternal, &in, [&](std::size_t block, Bytes b) {
        if (block == kExternalDepth) ReadExternalDepth(b, &frame);
      });
  if (!whole) return std::nullopt;
  return frame;
}

}  // namespace seastitch
