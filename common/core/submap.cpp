#include "common/core/submap.hpp"

namespace seastitch {

const char* ToString(SubmapTrigger trigger) {
  switch (trigger) {
    case SubmapTrigger::kInformation: return "information";
    case SubmapTrigger::kLength: return "length";
    case SubmapTrigger::kTurn: return "turn";
    case SubmapTrigger::kGap: return "gap";
    case SubmapTrigger::kEnd: return "end";
    case SubmapTrigger::kImported: return "imported";
    case SubmapTrigger::kFixes: return "fixes";
  }
  return "unknown";
}

}  // namespace seastitch
