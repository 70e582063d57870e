#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/files.hpp"

namespace seastitch::testing {

// Cuts a .kmall into so many of equal time, as folders DIR/NAME1, DIR/NAME2, ...: what the
// installation and the water are goes into each.
inline std::vector<std::filesystem::path> CutKmall(const std::filesystem::path& file,
                                                   int pieces,
                                                   const std::filesystem::path& dir,
                                                   const std::string& name) {
  const std::string all = TextOf(file);
  struct Datagram {
    std::string_view bytes;
    std::uint32_t second;
    bool for_all;
  };
  std::vector<Datagram> datagrams;
  for (std::size_t at = 0; at + 20 <= all.size();) {
    std::uint32_t size = 0, second = 0;
    std::memcpy(&size, all.data() + at, sizeof size);
    std::memcpy(&second, all.data() + at + 12, sizeof second);
    const std::string_view bytes = std::string_view(all).substr(at, size);
    const std::string_view type = bytes.substr(4, 4);
    datagrams.push_back({bytes, second, type == "#IIP" || type == "#SVP"});
    at += size;
  }
  const std::uint32_t first = datagrams.front().second;
  const double span = datagrams.back().second - first + 1.0;
  std::vector<std::filesystem::path> folders;
  for (int piece = 0; piece < pieces; ++piece) {
    folders.push_back(dir / (name + std::to_string(piece + 1)));
    std::filesystem::create_directories(folders.back());
    std::ofstream out(folders.back() / "lines.kmall", std::ios::binary);
    for (const Datagram& d : datagrams)
      if (d.for_all || static_cast<int>((d.second - first) / span * pieces) == piece)
        out.write(d.bytes.data(), static_cast<std::streamsize>(d.bytes.size()));
  }
  return folders;
}

}  // namespace seastitch::testing
