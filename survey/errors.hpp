#pragma once

#include <stdexcept>

namespace seastitch {

// An input whose content cannot be used: exit status 65.
struct DataError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// An impossible command line: exit status 64.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace seastitch
