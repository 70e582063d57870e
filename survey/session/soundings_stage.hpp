#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/core/placed_soundings.hpp"
#include "common/runtime/stage.hpp"
#include "products/files/sounding_log.hpp"
#include "survey/session/self_calibration.hpp"

namespace seastitch {

// Keeps the soundings of closed submaps, and makes the cells of self-calibration of them, beside
// the mapper.
class SoundingsStage {
 public:
  // calibration: null where nothing is calibrated.
  SoundingsStage(SoundingLog* soundings, SelfCalibration* calibration)
      : stage_(
            [=](const Item& item) {
              if (calibration != nullptr) calibration->Add(item.first);
              soundings->Add(item.first, item.second);
            },
            kMostWaiting) {}

  // inputs: as SoundingLog::Add(), whose errors it throws, too, if late.
  void Add(SubmapSoundings submap, std::vector<std::uint16_t> inputs) {
    stage_.Add({std::move(submap), std::move(inputs)});
  }
  // Waits until everything is kept.
  void Finish() { stage_.Finish(); }

 private:
  using Item = std::pair<SubmapSoundings, std::vector<std::uint16_t>>;
  static constexpr std::size_t kMostWaiting = 2;
  Stage<Item> stage_;
};

}  // namespace seastitch
