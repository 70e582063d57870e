#include "mapper/restart/map_starts.hpp"

#include <exception>
#include <fstream>
#include <string>
#include <utility>

#include "common/runtime/files/durable_file.hpp"

namespace seastitch {

MapStarts::MapStarts(std::filesystem::path map) : file_(std::move(map) / "starts") {
  std::ifstream(file_) >> ended_soon_;
  // Any other content of the file counts as zero.
  if (ended_soon_ < 0 || ended_soon_ > 1000) ended_soon_ = 0;
}

void MapStarts::Begin() {
  counts_ = true;
  Write(ended_soon_ + 1);
}

void MapStarts::Tick(bool has_gone_on, double now_s) {
  if (!counts_) return;
  if (since_s_ < 0.0 || has_gone_on != has_gone_on_) since_s_ = now_s;
  has_gone_on_ = has_gone_on;
  if (now_s - since_s_ >= kSoonS) Survive();
}

void MapStarts::Survive() {
  if (!std::exchange(counts_, false)) return;
  Write(0);
}

void MapStarts::Write(int starts) const {
  try {
    WriteDurably(file_, std::to_string(starts) + "\n");
  } catch (const std::exception&) {  // HEALTH reports disk errors elsewhere
  }
}

}  // namespace seastitch
