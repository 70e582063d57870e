#include "common/runtime/process.hpp"
