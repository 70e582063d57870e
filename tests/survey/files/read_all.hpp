#pragma once

#include <variant>

#include "common/core/sample.hpp"
#include "survey/read/sample_source.hpp"

namespace seastitch {

// Reads all samples of a source. on: functions of the kinds that count, such as of a const
// DvlSample&.
template <class... Functions>
void ReadAll(SampleSource* source, const Functions&... on) {
  const Overloaded use{on..., [](const auto&) {}};
  while (const auto received = source->Next()) std::visit(use, received->sample);
}

}  // namespace seastitch
