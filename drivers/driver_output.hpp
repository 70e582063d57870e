#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/convert/message_outbox.hpp"
#include "common/runtime/bus.hpp"

namespace seastitch {

// Takes what a driver makes: measurements, and the bytes that they were decoded from.
class DriverOutput {
 public:
  virtual ~DriverOutput() = default;
  // recv: receive time of the bytes.
  virtual void Put(Sample sample, Time recv) = 0;
  virtual void Put(const RawBytes& raw) = 0;
};

// Passes them on as encoded messages, such as to a log.
class MessageOutput : public DriverOutput {
 public:
  using Write = std::function<void(const std::string& channel, const void* data, std::size_t size)>;
  explicit MessageOutput(Write write) : write_(std::move(write)) {}

  void Put(Sample sample, Time recv) override {
    outbox_.Put(sample, recv, [this](const char* channel, const auto& msg) { Send(channel, msg); });
  }
  void Put(const RawBytes& raw) override {
    outbox_.Put(raw, [this](const std::string& channel, const auto& msg) { Send(channel, msg); });
  }
  template <class Msg>
  void Send(const std::string& channel, const Msg& msg) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
    msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    write_(channel, bytes.data(), bytes.size());
  }

 private:
  const Write write_;
  MessageOutbox outbox_;
};

// Publishes them: the output of a driver process.
class BusOutput : public MessageOutput {
 public:
  explicit BusOutput(Bus* bus)
      : MessageOutput([bus](const std::string& channel, const void* data, std::size_t size) {
          bus->PublishBytes(channel, data, size);
        }) {}
};

}  // namespace seastitch
