#pragma once

#include <unistd.h>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

namespace seastitch {

// Progress of a long step on stderr: one line rewritten in place on a terminal, otherwise a new
// line at each tenth.
class ProgressLine {
 public:
  ProgressLine(std::string what, std::uint64_t total, bool quiet)
      : what_(std::move(what)),
        total_(total),
        quiet_(quiet),
        terminal_(isatty(STDERR_FILENO) != 0) {}

  void Advance(std::uint64_t n) { Set(done_ + n); }
  void Set(std::uint64_t done) {
    done_ = done;
    if (quiet_ || total_ == 0) return;
    const int percent = static_cast<int>(done_ >= total_ ? 100 : 100 * done_ / total_);
    if (percent == shown_ || (!terminal_ && percent / 10 == shown_ / 10)) return;
    shown_ = percent;
    const std::string left = TimeLeft();
    std::fprintf(stderr,
                 terminal_ ? "\r%s: %d %%%s " : "%s: %d %%%s\n",
                 what_.c_str(),
                 percent,
                 left.c_str());
  }
  void Finish() {
    Set(total_);
    if (!quiet_ && terminal_ && shown_ >= 0) std::fprintf(stderr, "\n");
  }

 private:
  // Empty during the first seconds.
  std::string TimeLeft() const {
    const std::chrono::duration<double> past = std::chrono::steady_clock::now() - start_;
    if (past.count() < 5.0 || done_ == 0 || done_ >= total_) return {};
    const double left_s =
        past.count() * (static_cast<double>(total_) / static_cast<double>(done_) - 1.0);
    char text[40];
    std::snprintf(text, sizeof text, ", %d:%02d left", int(left_s) / 60, int(left_s) % 60);
    return text;
  }

  std::string what_;
  std::uint64_t total_;
  std::uint64_t done_ = 0;
  bool quiet_;
  bool terminal_;
  int shown_ = -1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace seastitch
