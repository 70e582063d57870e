#include "common/storage/submap_file.hpp"
