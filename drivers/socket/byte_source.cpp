#include "drivers/socket/byte_source.hpp"

#include "drivers/socket/serial_port.hpp"

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
  std::string refusal() const override { return socket_.refusal(); }
  Counters counters() const override { return socket_.counters(); }

 private:
  UdpSocket socket_;
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

}  // namespace

std::unique_ptr<ByteSource> OpenByteSource(const std::string& url, int receive_buffer_bytes) {
  if (url.starts_with("serial:")) return std::make_unique<SerialBytes>(url);
  return std::make_unique<UdpBytes>(url, receive_buffer_bytes);
}

}  // namespace seastitch
