#include "products/files/sounding_log.hpp"

#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>

namespace seastitch {
namespace {

template <class T>
void WriteAll(const std::vector<T>& items, std::fstream* file) {
  static_assert(std::is_trivially_copyable_v<T>);
  file->write(reinterpret_cast<const char*>(items.data()),
              static_cast<std::streamsize>(items.size() * sizeof(T)));
}

template <class T>
std::vector<T> ReadAll(std::uint64_t count, std::fstream* file) {
  std::vector<T> items(count);
  file->read(reinterpret_cast<char*>(items.data()),
             static_cast<std::streamsize>(count * sizeof(T)));
  return items;
}

// As on disk: Eigen's vectors are not trivially copyable.
struct StoredSounding {
  float p[3];
  std::uint32_t ping;
  std::uint16_t beam;
  bool used;
};

}  // namespace

SoundingLog::SoundingLog(std::filesystem::path file)
    : path_(std::move(file)),
      file_(path_, std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary) {
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

SoundingLog::~SoundingLog() {
  file_.close();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

void SoundingLog::Add(const SubmapSoundings& submap, const std::vector<std::uint16_t>& inputs) {
  std::vector<StoredSounding> soundings;
  soundings.reserve(submap.soundings.size());
  for (const SubmapSoundings::Sounding& s : submap.soundings)
    soundings.push_back(
        {{s.p_submap_m.x(), s.p_submap_m.y(), s.p_submap_m.z()}, s.ping, s.beam, s.used});
  WriteAll(submap.pings, &file_);
  WriteAll(inputs, &file_);
  WriteAll(soundings, &file_);
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written: disk full?");
  blocks_.push_back({submap.id, submap.pings.size(), soundings.size()});
}

void SoundingLog::ForEach(
    const std::function<void(const SubmapSoundings&, const std::vector<std::uint16_t>&)>& take) {
  file_.seekg(0);
  for (const Block& block : blocks_) {
    SubmapSoundings submap;
    submap.id = block.id;
    submap.pings = ReadAll<SubmapSoundings::Ping>(block.pings, &file_);
    const auto inputs = ReadAll<std::uint16_t>(block.pings, &file_);
    submap.soundings.reserve(block.soundings);
    for (const StoredSounding& s : ReadAll<StoredSounding>(block.soundings, &file_))
      submap.soundings.push_back({{s.p[0], s.p[1], s.p[2]}, s.ping, s.beam, s.used});
    if (!file_) throw std::runtime_error(path_.string() + ": cannot be read back");
    take(submap, inputs);
  }
}

}  // namespace seastitch
