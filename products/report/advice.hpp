#pragma once

#include <string>
#include <vector>

#include "products/write_products.hpp"

namespace seastitch {

// A value of the configuration that the survey's own data contradict.
struct Advice {
  std::string file;       // "vehicle.yaml", of which dive where there are several
  std::string key;        // "mbes.position_m"
  std::string now;        // as configured, as YAML has it
  std::string suggested;  // the same
  std::string reason;     // one sentence
};

// Each is beyond kAdviceSigmas and within the range of its key. Empty: the
// survey contradicts nothing.
std::vector<Advice> AdviceOf(const Survey& survey,
                             const ProductSummary& summary,
                             const ProductOptions& options);

}  // namespace seastitch
