#include "survey/replay/interruption.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <utility>

namespace seastitch {

Interruption::Interruption(std::function<void()> clean_up) : clean_up_(std::move(clean_up)) {
  loop_.Every(std::chrono::milliseconds(20), [this] {
    if (over_) loop_.Stop();
  });
  thread_ = std::thread([this] { Main(); });
}

Interruption::~Interruption() {
  over_ = true;
  thread_.join();
}

void Interruption::Main() {
  loop_.Run();
  if (over_) return;
  requested_ = true;
  std::fputs("ending with what was read; Ctrl-C again ends at once, without a map\n", stderr);
  loop_.Run();
  if (over_) return;
  clean_up_();
  _exit(kExitCode);
}

}  // namespace seastitch
