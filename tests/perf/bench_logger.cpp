// seastitch-logger side by side with Debian's lcm-logger: what each keeps of what it is sent, what
// it tells of the rest, and what it costs. Both as installed, one after the other, on one bus.
// Usage (it needs a multicast route; `./run logger` makes one):
//   seastitch-bench-logger [SECONDS]      of the steady load, 60 where not given

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "common/storage/event_log.hpp"
#include "seastitch/raw_bytes_t.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kUrl[] = "udpm://239.255.76.67:7667?ttl=0";
constexpr char kChannel[] = "RAW_TEST";

enum class Kind { kOurs, kDebian };

void Pause(milliseconds time) { std::this_thread::sleep_for(time); }

// A logger at work in a folder of its own.
class Logger {
 public:
  Logger(Kind kind, const fs::path& ours, const fs::path& dir) : kind_(kind), dir_(dir) {
    fs::remove_all(dir_);
    fs::create_directories(dir_);
    std::ofstream(dir_ / "logger.yaml") << "dives_dir: dives\ndisk_min_free_mb: 0\n";
    const std::string config = dir_ / "logger.yaml";
    const std::string log = dir_ / "lcm.log";
    const std::string output = dir_ / "output.txt";
    const std::string program = ours;
    pid_ = fork();
    if (pid_ == 0) {
      const int fd = open(output.c_str(), O_WRONLY | O_CREAT, 0644);
      dup2(fd, STDOUT_FILENO);
      dup2(fd, STDERR_FILENO);
      std::signal(SIGXFSZ, SIG_IGN);  // a full disk is an error of write(), not the end
      if (kind == Kind::kOurs)
        execl(program.c_str(),
              program.c_str(),
              "--config",
              config.c_str(),
              "--lcm-url",
              kUrl,
              nullptr);
      else
        execlp("lcm-logger", "lcm-logger", "--lcm-url", kUrl, log.c_str(), nullptr);
      _exit(127);
    }
    Pause(milliseconds(1'500));
  }
  ~Logger() {
    if (pid_ > 0) End(SIGKILL);
    fs::remove_all(dir_);
  }
  Logger(const Logger&) = delete;
  Logger& operator=(const Logger&) = delete;

  void Signal(int signal) const { kill(pid_, signal); }
  void AllowFileSize(rlim_t bytes) const {
    rlimit limit{};
    prlimit(pid_, RLIMIT_FSIZE, nullptr, &limit);
    limit.rlim_cur = bytes;
    prlimit(pid_, RLIMIT_FSIZE, &limit, nullptr);
  }
  void End(int signal) {
    kill(pid_, signal);
    int status = 0;
    rusage usage{};
    wait4(pid_, &status, 0, &usage);
    pid_ = -1;
    const auto in_seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    cpu_s_ = in_seconds(usage.ru_utime) + in_seconds(usage.ru_stime);
  }
  double cpu_s() const { return cpu_s_; }

  // Numbers of the messages that are in its files.
  std::set<std::int64_t> Kept() const {
    std::set<std::int64_t> numbers;
    for (const auto& entry : fs::recursive_directory_iterator(dir_)) {
      const std::string name = entry.path().filename();
      if (!name.ends_with(".lcmlog") && !name.starts_with("lcm.log")) continue;
      try {
        EventLogReader reader(entry.path());
        while (const auto event = reader.Next()) {
          raw_bytes_t msg{};
          if (event->channel == kChannel &&
              msg.decode(event->data.data(), 0, static_cast<int>(event->data.size())) > 0)
            numbers.insert(msg.seq);
        }
      } catch (const std::exception&) {  // a log without a whole event
      }
    }
    return numbers;
  }

  // What it says at its end of what was lost: of ours "...; 3 dropped, 4 lost on the way".
  std::optional<std::int64_t> Told() const {
    if (kind_ == Kind::kDebian) return std::nullopt;
    std::ifstream in(dir_ / "output.txt");
    long long dropped = 0;
    long long lost = 0;
    for (std::string line; std::getline(in, line);)
      if (const auto at = line.find(" bytes; "); at != std::string::npos)
        std::sscanf(line.c_str() + at, " bytes; %lld dropped, %lld lost", &dropped, &lost);
    return dropped + lost;
  }

 private:
  Kind kind_;
  fs::path dir_;
  pid_t pid_ = -1;
  double cpu_s_ = 0.0;
};

// Numbers its messages from 0.
class Sender {
 public:
  explicit Sender(std::size_t payload) : bus_(kUrl) {
    msg_.num_parts = 1;
    msg_.size = static_cast<std::int32_t>(payload);
    msg_.data.assign(payload, 7);
  }
  void Send() {
    msg_.recv_utime = NowUtime();
    bus_.Publish(kChannel, msg_);
    ++msg_.seq;
  }
  void Burst(int messages) {
    for (int i = 0; i < messages; ++i) Send();
  }
  // messages: a second.
  void Steadily(int messages, milliseconds time, const std::function<bool()>& stop = {}) {
    const auto begin = SteadyClock::now();
    const std::int64_t first = msg_.seq;
    for (auto now = begin; now < begin + time && !(stop && stop()); now = SteadyClock::now()) {
      const auto due = std::chrono::duration<double>(now - begin).count() * messages;
      while (static_cast<double>(msg_.seq - first) < due) Send();
      std::this_thread::sleep_for(microseconds(500));
    }
  }
  std::int64_t sent() const { return msg_.seq; }

 private:
  Bus bus_;
  raw_bytes_t msg_{};
};

struct Result {
  std::int64_t sent = 0;
  std::int64_t kept = 0;
  std::optional<std::int64_t> told;  // of what was lost
  double cpu_s = 0.0;
  double worst_ms = -1.0;  // kill -9: how old the oldest lost message was
};

void Print(const char* name, const Result& ours, const Result& debian) {
  const auto lost = [](const Result& r) { return static_cast<long long>(r.sent - r.kept); };
  std::printf("%-34s %9lld | %9lld %8lld %8lld %7.2f",
              name,
              static_cast<long long>(ours.sent),
              static_cast<long long>(ours.kept),
              lost(ours),
              static_cast<long long>(ours.told.value_or(-1)),
              ours.cpu_s);
  std::printf(
      " | %9lld %8lld %7.2f", static_cast<long long>(debian.kept), lost(debian), debian.cpu_s);
  if (ours.worst_ms >= 0.0) std::printf(" | %.0f ms, %.0f ms", ours.worst_ms, debian.worst_ms);
  std::printf("\n");
  std::fflush(stdout);
}

class Bench {
 public:
  explicit Bench(fs::path logger)
      : logger_(std::move(logger)),
        dir_(fs::temp_directory_path() / ("seastitch-logger-" + std::to_string(getpid()))) {}
  ~Bench() { fs::remove_all(dir_); }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  // load: while the logger runs; it is ended in order afterwards, after its next HEALTH.
  void Case(const char* name,
            std::size_t payload,
            const std::function<void(Sender*, Logger*)>& load,
            milliseconds rest = milliseconds(2'500)) {
    const auto run = [&](Kind kind) {
      Logger logger(kind, logger_, dir_);
      Sender sender(payload);
      load(&sender, &logger);
      Pause(rest);
      logger.End(SIGTERM);
      return Result{sender.sent(),
                    static_cast<std::int64_t>(logger.Kept().size()),
                    logger.Told(),
                    logger.cpu_s()};
    };
    const Result ours = run(Kind::kOurs);
    Print(name, ours, run(Kind::kDebian));
  }

  // 1,000 messages a second until kill -9, at another moment each time.
  void KillNine(int trials) {
    const auto run = [&](Kind kind) {
      Result sum;
      sum.worst_ms = 0.0;
      for (int trial = 0; trial < trials; ++trial) {
        Logger logger(kind, logger_, dir_);
        Sender sender(200);
        sender.Steadily(1'000, milliseconds(1'000 + 37 * trial));
        const std::int64_t sent = sender.sent();
        logger.End(SIGKILL);
        const auto kept = static_cast<std::int64_t>(logger.Kept().size());
        sum.sent += sent;
        sum.kept += kept;
        sum.worst_ms = std::max(sum.worst_ms, static_cast<double>(sent - kept));  // 1 ms each
      }
      return sum;
    };
    const Result ours = run(Kind::kOurs);
    Print("kill -9 at 1,000/s, all trials", ours, run(Kind::kDebian));
  }

 private:
  fs::path logger_;
  fs::path dir_;
};

void Main(const fs::path& self, int steady_s) {
  Bench bench(self.parent_path() / "seastitch-logger");
  std::printf("%-34s %9s | %9s %8s %8s %7s | %9s %8s %7s | %s\n",
              "",
              "sent",
              "ours kept",
              "lost",
              "told",
              "CPU s",
              "lcm kept",
              "lost",
              "CPU s",
              "worst lost: ours, lcm");
  const auto bursts = [](Sender* sender, Logger*) {
    for (int i = 0; i < 20; ++i) {
      sender->Burst(2'000);
      Pause(milliseconds(500));
    }
  };
  bench.Case("20 bursts of 2,000 x 200 B", 200, bursts);
  bench.Case("20 bursts of 2,000 x 8 kB", 8'000, bursts);
  bench.Case("25 MB/s, 8 kB messages", 8'000, [&](Sender* sender, Logger*) {
    sender->Steadily(3'125, seconds(steady_s));
  });
  bench.Case("60,000/s, 10.6 MB/s, 10 s", 110, [](Sender* sender, Logger*) {
    sender->Steadily(60'000, seconds(10));
  });
  bench.KillNine(20);
  bench.Case("disk full for 2 s, room again", 200, [](Sender* sender, Logger* logger) {
    logger->AllowFileSize(300'050);
    sender->Steadily(2'000, seconds(2));
    logger->AllowFileSize(RLIM_INFINITY);
    sender->Steadily(2'000, seconds(1));
  });
  bench.Case(
      "20,000 x 200 B, SIGTERM at once",
      200,
      [](Sender* sender, Logger*) { sender->Steadily(40'000, milliseconds(500)); },
      milliseconds(0));
  bench.Case("SIGSTOP for 5 s at 1,000/s", 200, [](Sender* sender, Logger* logger) {
    sender->Steadily(1'000, seconds(1));
    logger->Signal(SIGSTOP);
    sender->Steadily(1'000, seconds(5));
    logger->Signal(SIGCONT);
    sender->Steadily(1'000, seconds(1));
  });
}

}  // namespace
}  // namespace seastitch

int main(int argc, char** argv) try {
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe");
  seastitch::Main(self, argc > 1 ? std::max(1, std::atoi(argv[1])) : 60);
  return EXIT_SUCCESS;
} catch (const std::exception& e) {
  std::fprintf(stderr, "seastitch-bench-logger: %s\n", e.what());
  return EXIT_FAILURE;
}
