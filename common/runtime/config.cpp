#include "common/runtime/config.hpp"
