#include "drivers/socket/byte_source.hpp"

#include <deque>
#include <utility>

#include "drivers/can/can_errors.hpp"
#include "drivers/socket/can_source.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "drivers/socket/serial_port.hpp"
#include "drivers/socket/tcp_socket.hpp"

namespace seastitch {
namespace {

class UdpBytes : public ByteSource {
 public:
  UdpBytes(const std::string& url, int receive_buffer_bytes) : socket_(url, receive_buffer_bytes) {}
  int fd() const override { return socket_.fd(); }
  bool Receive(Datagram* piece) override { return socket_.Receive(piece); }
  void Understood(const Datagram& piece) override { socket_.Understood(piece); }
  void Check() override { socket_.CheckInterface(); }
  std::string trouble() const override { return socket_.trouble(); }
  SenderRefusal refusal() const override { return socket_.refusal(); }
  Counters counters() const override { return socket_.counters(); }

 private:
  UdpSocket socket_;
};

class TcpBytes : public ByteSource {
 public:
  explicit TcpBytes(const std::string& url) : socket_(url) {}
  int fd() const override { return socket_.fd(); }
  bool Receive(Datagram* piece) override { return socket_.Receive(piece); }
  void Check() override { socket_.Check(); }
  std::string trouble() const override { return socket_.trouble(); }
  Counters counters() const override { return socket_.counters(); }

 private:
  TcpSocket socket_;
};

class SerialBytes : public ByteSource {
 public:
  explicit SerialBytes(const std::string& url) : port_(url) {}
  int fd() const override { return port_.fd(); }
  bool Receive(Datagram* piece) override { return port_.Receive(piece); }
  void Check() override { port_.CheckErrors(); }
  std::string trouble() const override { return port_.trouble(); }
  Counters counters() const override { return port_.counters(); }

 private:
  SerialPort port_;
};

class CanBytes : public ByteSource {
 public:
  explicit CanBytes(std::unique_ptr<CanSource> source) : source_(std::move(source)) {}
  int fd() const override { return source_->fd(); }
  bool Receive(Datagram* piece) override {
    if (packets_.empty()) Read();
    if (packets_.empty()) return false;
    *piece = {std::move(packets_.front().bytes), packets_.front().recv, 0};
    packets_.pop_front();
    return true;
  }
  void Check() override { errors_.SeeOutages(source_->outages()); }
  bool finished() const override { return packets_.empty() && source_->finished(); }
  std::string trouble() const override { return source_->trouble(); }
  std::string can_trouble() const override { return errors_.trouble(); }
  SenderRefusal refusal() const override { return source_->refusal(); }
  Counters counters() const override {
    Counters all = source_->counters();
    all.insert(errors_.counters().begin(), errors_.counters().end());
    return all;
  }

 private:
  void Read() {
    const std::vector<ReceivedFrame> frames = source_->Receive();
    for (const ReceivedFrame& received : frames)
      received.frame.error ? errors_.Add(received.frame) : errors_.SeeData();
    for (StampedPacket& packet : PackReceived(frames, seq_)) {
      packets_.push_back(std::move(packet));
      ++seq_;
    }
  }

  std::unique_ptr<CanSource> source_;
  CanErrors errors_;
  std::uint8_t seq_ = 0;
  std::deque<StampedPacket> packets_;  // packets read in one call, not yet returned
};

}  // namespace

std::unique_ptr<ByteSource> OpenByteSource(const std::string& url, int receive_buffer_bytes) {
  if (url.starts_with("tcp:")) return std::make_unique<TcpBytes>(url);
  if (url.starts_with("serial:")) return std::make_unique<SerialBytes>(url);
  return std::make_unique<UdpBytes>(url, receive_buffer_bytes);
}

std::unique_ptr<ByteSource> OpenCanBytes(const std::string& url,
                                         const std::vector<CanFilter>& filters,
                                         int receive_buffer_bytes) {
  return std::make_unique<CanBytes>(OpenCanSource(url, filters, receive_buffer_bytes));
}

}  // namespace seastitch
