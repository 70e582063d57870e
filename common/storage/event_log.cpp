#include "common/storage/event_log.hpp"
