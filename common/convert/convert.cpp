#include "common/convert/convert.hpp"
