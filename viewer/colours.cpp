#include "viewer/colours.hpp"

#include <cstdint>
#include <initializer_list>

namespace seastitch {
namespace {

ColourScale FromHex(std::initializer_list<std::uint32_t> colours) {
  ColourScale scale;
  for (const std::uint32_t c : colours) {
    scale.push_back({static_cast<double>((c >> 16) & 255u) / 255.0,
                     static_cast<double>((c >> 8) & 255u) / 255.0,
                     static_cast<double>(c & 255u) / 255.0});
  }
  return scale;
}

}  // namespace

const ColourScale& DepthColours() {
  static const ColourScale scale =
      FromHex({0xFBF3C8, 0xD9EBB5, 0x9AD8B4, 0x58BEBE, 0x349CC0, 0x2C76B4, 0x2C519C, 0x24326F});
  return scale;
}

const ColourScale& ConsistencyColours() {
  static const ColourScale scale =
      FromHex({0xFDF6C9, 0xFDDB85, 0xFBB155, 0xF07F43, 0xD34E4A, 0xA42C5C, 0x6B1B62, 0x32104D});
  return scale;
}

}  // namespace seastitch
