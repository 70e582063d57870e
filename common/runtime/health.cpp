#include "common/runtime/health.hpp"
