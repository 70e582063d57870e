#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "mapper/mapper_config.hpp"
#include "mapper/navigation/ins/ins_navigation.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/file_clocks.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_config.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/plan/survey_plan.hpp"
#include "survey/read/message_types.hpp"
#include "survey/read/survey_stream.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/read_all.hpp"
#include "tests/survey/files/small_kmall.hpp"

// What the tests of a survey's plan and of its inputs share.
namespace seastitch {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

}  // namespace seastitch
