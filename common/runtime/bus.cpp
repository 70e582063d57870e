#include "common/runtime/bus.hpp"
