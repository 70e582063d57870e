#include "codecs/frame_stream.hpp"

#include <algorithm>

namespace seastitch {

std::vector<FrameStream::Frame> FrameStream::Add(Bytes piece, Time recv) {
  std::vector<Frame> frames;
  if (piece.empty()) return frames;
  open_.insert(open_.end(), piece.begin(), piece.end());
  pieces_.push_back({piece.size(), recv});
  std::size_t at = 0;
  while (at < open_.size()) {
    const Bytes rest = Bytes(open_).subspan(at);
    const std::optional<std::size_t> size = size_of_(rest);
    if (size == 0 && rest.size() <= kLongest) break;
    if (!size || *size == 0) {
      ++skipped_bytes_;
      ++at;
      Drop(1);
      continue;
    }
    frames.push_back(
        {{rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(*size)}, pieces_.front().recv});
    at += *size;
    Drop(*size);
  }
  open_.erase(open_.begin(), open_.begin() + static_cast<std::ptrdiff_t>(at));
  return frames;
}

void FrameStream::Drop(std::size_t bytes) {
  while (bytes > 0 && !pieces_.empty()) {
    Piece& first = pieces_.front();
    const std::size_t taken = std::min(bytes, first.bytes);
    first.bytes -= taken;
    bytes -= taken;
    if (first.bytes == 0) pieces_.pop_front();
  }
}

}  // namespace seastitch
