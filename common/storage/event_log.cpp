#include "common/storage/event_log.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "common/core/bytes.hpp"

namespace seastitch {
namespace {

constexpr std::uint32_t kSync = 0xEDA1DA01;
constexpr std::size_t kHeaderSize = 28;
constexpr std::uint32_t kMaxChannelLength = 63;     // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr std::uint32_t kMaxDataLength = 1U << 28;  // limit of a message
constexpr std::size_t kWindow = 1 << 20;
constexpr std::size_t kWindowAfterSkip = 1 << 10;  // it doubles where no data is skipped
constexpr std::size_t kWriteBuffer = 1 << 18;

std::runtime_error FileError(const std::filesystem::path& path, const std::string& reason) {
  return std::runtime_error(path.string() + ": " + reason);
}

// An open file, closed with its owner.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : fd_(open(path.c_str(), flags | O_CLOEXEC, 0644)) {
    if (fd_ < 0) throw FileError(path, std::strerror(errno));
  }
  ~Descriptor() { close(fd_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

std::uint64_t SizeOf(int fd, const std::filesystem::path& path) {
  struct stat status {};
  if (fstat(fd, &status) != 0) throw FileError(path, std::strerror(errno));
  if (!S_ISREG(status.st_mode)) throw FileError(path, "not a file");
  return static_cast<std::uint64_t>(status.st_size);
}

struct Header {
  std::int64_t utime = 0;
  std::uint32_t channel_length = 0;
  std::uint32_t data_length = 0;
  std::uint64_t EventSize() const { return kHeaderSize + channel_length + data_length; }
};

std::optional<Header> ParseHeader(Bytes bytes) {
  ByteReader in(bytes);
  Header header;
  const auto sync = in.Be<std::uint32_t>();
  in.Skip(8);  // the event number: not used, because it restarts where a log was appended to
  header.utime = in.Be<std::int64_t>();
  header.channel_length = in.Be<std::uint32_t>();
  header.data_length = in.Be<std::uint32_t>();
  const bool plausible = in.ok() && sync == kSync && header.channel_length >= 1 &&
                         header.channel_length <= kMaxChannelLength &&
                         header.data_length <= kMaxDataLength;
  return plausible ? std::optional(header) : std::nullopt;
}

bool IsChannelName(Bytes name) { return std::find(name.begin(), name.end(), 0) == name.end(); }

}  // namespace

bool IsLoggable(const std::string& channel, std::size_t data_size) {
  return !channel.empty() && channel.size() <= kMaxChannelLength &&
         channel.find('\0') == std::string::npos && data_size <= kMaxDataLength;
}

std::size_t SizeInLog(const LogEvent& event) {
  return kHeaderSize + event.channel.size() + event.data.size() + event.unread;
}

struct EventLogReader::Impl {
  Impl(const LogPart& log, Wanted wanted_of_channel)
      : wanted(std::move(wanted_of_channel)),
        file(log.path, O_RDONLY),
        size(std::min(log.end, SizeOf(file.get(), log.path))),
        position(log.begin) {}

  // Bytes [at, at + n) of the file, fewer at its end. Valid until the next call.
  Bytes View(std::uint64_t at, std::uint64_t n) {
    n = std::min(n, size - std::min(at, size));
    if (ahead_at == at && ahead.size() >= n && !Holds(at, n)) {
      window_at = at;
      window_size = ahead.size();
      std::swap(window, ahead);
      ahead.clear();
    }
    const std::uint64_t end = window_at + window.size();
    if (!Holds(at, n)) {
      const bool skips = wanted && (at < window_at || at > end);
      window_size = skips ? kWindowAfterSkip : std::min(2 * window_size, kWindow);
      Fill(at, std::max<std::uint64_t>(n, window_size));
    }
    const std::uint64_t begin = std::min<std::uint64_t>(at - window_at, window.size());
    return Bytes(window).subspan(begin, std::min<std::uint64_t>(n, window.size() - begin));
  }

  // Whether the window has the bytes [at, at + n).
  bool Holds(std::uint64_t at, std::uint64_t n) const {
    return at >= window_at && at + n <= window_at + window.size();
  }

  // The bytes from `at` to the end of the window; at least one unless the file ends.
  Bytes Rest(std::uint64_t at) {
    View(at, 1);
    return View(at, std::max<std::uint64_t>(1, window_at + window.size() - at));
  }

  void Fill(std::uint64_t at, std::uint64_t n) {
    window_at = at;
    window.resize(std::min(n, size - std::min(at, size)));
    window.resize(Read(at, window.data(), window.size()));
  }

  std::size_t Read(std::uint64_t at, std::uint8_t* bytes, std::size_t n) const {
    std::size_t have = 0;
    while (have < n) {
      const ssize_t got = pread(file.get(), bytes + have, n - have, static_cast<off_t>(at + have));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;  // a bad sector, or a file that shrinks: the bytes read so far are used
      have += static_cast<std::size_t>(got);
    }
    return have;
  }

  // True if another event, or the end of the file, is at `end`. A position outside the window is
  // read without moving the window: a damaged length must not cost a megabyte of reading. Where
  // data is skipped, the next event is read with it.
  bool IsFollowed(std::uint64_t end) {
    constexpr std::array<std::uint8_t, 4> kSyncBytes = {0xED, 0xA1, 0xDA, 0x01};
    if (end >= window_at && end + kSyncBytes.size() <= window_at + window.size())
      return std::ranges::equal(Bytes(window).subspan(end - window_at, kSyncBytes.size()),
                                kSyncBytes);
    const bool skips = wanted && end > window_at + window.size() + kWindowAfterSkip;
    ahead_at = end;
    ahead.resize(std::min<std::uint64_t>(skips ? kWindowAfterSkip : kSyncBytes.size(),
                                         size - std::min(end, size)));
    ahead.resize(Read(end, ahead.data(), ahead.size()));
    // Fewer bytes if the log is cut there.
    const std::size_t n = std::min(ahead.size(), kSyncBytes.size());
    return std::equal(
        ahead.begin(), ahead.begin() + static_cast<std::ptrdiff_t>(n), kSyncBytes.begin());
  }

  std::optional<LogEvent> EventAt(std::uint64_t at) {
    const Bytes head = View(at, kHeaderSize + kMaxChannelLength);
    const std::optional<Header> header = ParseHeader(head);
    if (!header || header->EventSize() > size - at) return std::nullopt;
    const Bytes name = head.subspan(kHeaderSize).first(header->channel_length);
    if (!IsChannelName(name) || !IsFollowed(at + header->EventSize())) return std::nullopt;
    LogEvent event{header->utime, std::string(name.begin(), name.end()), {}};
    const std::uint64_t data_at = at + kHeaderSize + header->channel_length;
    const std::size_t length = header->data_length;
    const std::size_t n = wanted ? std::min(length, wanted(event.channel)) : length;
    const Bytes data = View(data_at, n);
    if (data.size() != n) return std::nullopt;
    event.unread = length - n;
    event.data.assign(data.begin(), data.end());
    return event;
  }

  // The next position from `at` on where a sync word can start; the file's size if there is none.
  std::uint64_t FindSync(std::uint64_t at) {
    while (at < size) {
      const Bytes rest = Rest(at);
      if (rest.empty()) return size;
      const auto found = std::find(rest.begin(), rest.end(), std::uint8_t{kSync >> 24});
      if (found != rest.end()) return at + static_cast<std::uint64_t>(found - rest.begin());
      at += rest.size();
    }
    return size;
  }

  std::optional<LogEvent> Next() {
    while (position < size) {
      if (std::optional<LogEvent> event = EventAt(position)) {
        position += SizeInLog(*event);
        torn = false;
        return event;
      }
      if (!std::exchange(torn, true)) ++tears;
      const std::uint64_t next = FindSync(position + 1);
      damaged_bytes += static_cast<std::int64_t>(next - position);
      position = next;
    }
    return std::nullopt;
  }

  const Wanted wanted;
  Descriptor file;
  std::uint64_t size;  // end of the part
  std::uint64_t position;
  std::int64_t damaged_bytes = 0;
  std::int64_t tears = 0;
  bool torn = false;  // since the last whole event
  std::uint64_t window_at = 0;
  std::size_t window_size = kWindow;  // of the last reading, at most
  std::vector<std::uint8_t> window;
  std::uint64_t ahead_at = 0;
  std::vector<std::uint8_t> ahead;  // read by IsFollowed(): may become the window
  std::optional<LogEvent> first;    // read by the constructor
};

EventLogReader::EventLogReader(const LogPart& log, Wanted wanted)
    : impl_(std::make_unique<Impl>(log, std::move(wanted))) {
  impl_->first = impl_->Next();
  if (!impl_->first) throw NoEventError(log.path.string() + ": holds no LCM event");
}

EventLogReader::~EventLogReader() = default;

std::optional<LogEvent> EventLogReader::Next() {
  if (impl_->first) return std::exchange(impl_->first, std::nullopt);
  return impl_->Next();
}

std::uint64_t EventLogReader::position() const { return impl_->position; }

std::int64_t EventLogReader::damaged_bytes() const { return impl_->damaged_bytes; }

std::int64_t EventLogReader::tears() const { return impl_->tears; }

struct EventLogWriter::Impl {
  Impl(const std::filesystem::path& file_path, IfExists if_exists)
      : path(file_path),
        file(std::make_shared<Descriptor>(
            file_path, O_WRONLY | O_CREAT | (if_exists == IfExists::kRefuse ? O_EXCL : O_TRUNC))) {}

  void Flush() {
    std::size_t written = 0;
    while (written < waiting.bytes().size()) {
      const ssize_t n =
          write(file->get(), waiting.bytes().data() + written, waiting.bytes().size() - written);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) CutBack(written, errno);
      written += static_cast<std::size_t>(n);
    }
    Drop(written);
  }

  // Truncates the file to its last whole event after a failed write. The events not written remain
  // in memory.
  [[noreturn]] void CutBack(std::size_t written, int error) {
    const auto torn = std::upper_bound(ends.begin(), ends.end(), written);
    Drop(torn == ends.begin() ? 0 : *std::prev(torn));
    if (ftruncate(file->get(), file_size) != 0 || lseek(file->get(), file_size, SEEK_SET) < 0)
      throw FileError(path, std::string("cannot cut off a torn event: ") + std::strerror(errno));
    throw FileError(path, std::strerror(error));
  }

  // Removes the first n waiting bytes, which are whole events and now in the file.
  void Drop(std::size_t n) {
    const std::vector<std::uint8_t> all = waiting.Release();
    waiting = ByteWriter();
    waiting.Append(Bytes(all).subspan(n));
    events_in_file +=
        static_cast<std::int64_t>(std::erase_if(ends, [n](std::size_t end) { return end <= n; }));
    for (std::size_t& end : ends) end -= n;
    file_size += static_cast<off_t>(n);
  }

  void Append(std::int64_t utime, const std::string& channel, Bytes data) {
    waiting.Be(kSync);
    waiting.Be(event_number++);
    waiting.Be(utime);
    waiting.Be(static_cast<std::uint32_t>(channel.size()));
    waiting.Be(static_cast<std::uint32_t>(data.size()));
    waiting.Append(AsBytes(channel));
    waiting.Append(data);
    ends.push_back(waiting.size());
  }

  std::filesystem::path path;
  std::shared_ptr<Descriptor> file;
  ByteWriter waiting;             // whole events, not yet in the file
  std::vector<std::size_t> ends;  // end of each waiting event
  off_t file_size = 0;
  std::int64_t event_number = 0;
  std::int64_t events_in_file = 0;
};

EventLogWriter::EventLogWriter(const std::filesystem::path& path, IfExists if_exists)
    : impl_(std::make_unique<Impl>(path, if_exists)) {}

EventLogWriter::EventLogWriter(EventLogWriter&&) noexcept = default;

EventLogWriter::~EventLogWriter() {
  if (!impl_) return;  // moved-from object
  try {
    Flush();
  } catch (const std::exception&) {
    // Errors are ignored here. Callers that must know whether the last events are written call
    // Flush() before.
  }
}

void EventLogWriter::Write(std::int64_t utime,
                           const std::string& channel,
                           const void* data,
                           std::size_t size) {
  if (!IsLoggable(channel, size))
    throw FileError(impl_->path, "an LCM event log cannot hold such an event");
  if (impl_->waiting.size() >= kWriteBuffer) Flush();
  impl_->Append(utime, channel, Bytes(static_cast<const std::uint8_t*>(data), size));
}

void EventLogWriter::Flush() { impl_->Flush(); }

void EventLogWriter::Sync() {
  Flush();
  Syncer()();
}

std::function<void()> EventLogWriter::Syncer() const {
  return [file = impl_->file, path = impl_->path] {
    if (fdatasync(file->get()) != 0) throw FileError(path, std::strerror(errno));
  };
}

std::int64_t EventLogWriter::bytes() const { return impl_->file_size; }

std::int64_t EventLogWriter::events() const { return impl_->events_in_file; }

}  // namespace seastitch
