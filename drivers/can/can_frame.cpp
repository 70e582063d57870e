#include "drivers/can/can_frame.hpp"

#include <algorithm>

namespace seastitch {
namespace {

constexpr std::uint32_t kExtendedMask = 0x1FFFFFFF;
constexpr std::uint32_t kStandardMask = 0x7FF;

}  // namespace

void CanFrame::SetData(Bytes data) {
  const std::size_t n = std::min(data.size(), bytes.size());
  bytes.fill(0);
  std::copy_n(data.begin(), n, bytes.begin());
  length = static_cast<std::uint8_t>(n);
}

bool Passes(const std::vector<CanFilter>& filters, const CanFrame& frame) {
  if (frame.error) return true;
  if (frame.remote) return false;
  return std::any_of(filters.begin(), filters.end(), [&frame](const CanFilter& filter) {
    return filter.extended == frame.extended && ((frame.id ^ filter.id) & filter.mask) == 0;
  });
}

std::uint32_t IdWord(const CanFrame& frame) {
  return frame.id | (frame.extended ? kCanExtended : 0) | (frame.remote ? kCanRemote : 0) |
         (frame.error ? kCanError : 0);
}

void SetIdWord(std::uint32_t word, CanFrame* frame) {
  frame->extended = (word & kCanExtended) != 0;
  frame->remote = (word & kCanRemote) != 0;
  frame->error = (word & kCanError) != 0;
  frame->id = word & (frame->extended || frame->error ? kExtendedMask : kStandardMask);
}

}  // namespace seastitch
