#include "page/page_server.hpp"

#include <arpa/inet.h>
#include <httplib.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <functional>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include "page/live_page.hpp"

namespace seastitch {
namespace {

constexpr int kThreads = 2 * PageServer::kMostClients;
constexpr std::size_t kMostWaiting = 64;  // connections; further ones wait in the kernel
constexpr int kIdleS = 1;                 // until a request begins
constexpr int kSilentS = 5;               // within a request, and while a client reads
constexpr std::chrono::seconds kBeat(2);  // a comment is sent where there is no state

// Threads for the connections, of which a limited number waits for one.
class BoundedQueue : public httplib::TaskQueue {
 public:
  BoundedQueue() : pool_(kThreads) {}
  void enqueue(std::function<void()> fn) override {
    {
      std::unique_lock lock(mutex_);
      less_.wait(lock, [this] { return waiting_ < kMostWaiting || ends_; });
      ++waiting_;
    }
    pool_.enqueue([this, fn = std::move(fn)] {
      {
        const std::lock_guard lock(mutex_);
        --waiting_;
      }
      less_.notify_one();
      fn();
    });
  }
  void shutdown() override {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    less_.notify_all();
    pool_.shutdown();
  }

 private:
  httplib::ThreadPool pool_;
  std::mutex mutex_;
  std::condition_variable less_;
  std::size_t waiting_ = 0;
  bool ends_ = false;
};

bool IsIpAddress(const std::string& text) {
  in6_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

// Without its port.
std::string NameOf(std::string_view host) {
  if (host.starts_with('[')) return std::string(host.substr(1, host.find(']') - 1));
  return std::string(host.substr(0, host.find(':')));
}

// The lines of a server-sent event.
std::string EventOf(const std::string& json) {
  std::istringstream lines(json);
  std::string event;
  for (std::string line; std::getline(lines, line);) event += "data: " + line + "\n";
  return event + "\n";
}

}  // namespace

ListenAddress ParseListenAddress(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  ListenAddress address{text.substr(0, colon), -1};
  in_addr numeric{};
  if (colon != std::string::npos) {
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, address.port);
    if (error != std::errc() || stop != end) address.port = -1;
  }
  if (address.port < 0 || address.port > 65535 ||
      inet_pton(AF_INET, address.host.c_str(), &numeric) != 1)
    throw std::runtime_error("'" + text +
                             "': expected ADDRESS:PORT, an IPv4 address and a port from 0 to "
                             "65535, such as 127.0.0.1:8642");
  return address;
}

bool IsLoopback(const ListenAddress& address) { return address.host.starts_with("127."); }

struct PageServer::Impl {
  Impl(const ListenAddress& address, PageFeed* to_show) : feed(to_show) {
    server.new_task_queue = [] { return new BoundedQueue; };
    // Not SO_REUSEPORT, the library's default: another program could take half of the connections.
    server.set_socket_options([](int socket) {
      const int on = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    });
    server.set_keep_alive_max_count(1);
    server.set_keep_alive_timeout(kIdleS);
    server.set_read_timeout(kSilentS);
    server.set_write_timeout(kSilentS);
    server.set_payload_max_length(0);
    server.set_default_headers({{"Content-Security-Policy", LivePagePolicy()},
                                {"X-Content-Type-Options", "nosniff"},
                                {"Referrer-Policy", "no-referrer"},
                                {"Cache-Control", "no-store"}});
    server.set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          const std::string name = NameOf(request.get_header_value("Host"));
          const bool is_get = request.method == "GET";
          if (is_get && (name == "localhost" || IsIpAddress(name)))
            return httplib::Server::HandlerResponse::Unhandled;
          Refuse(is_get ? 421 : 405, &response);
          if (is_get)
            response.set_content("Open the page by localhost or an IP address, not by a name.\n",
                                 "text/plain; charset=utf-8");
          return httplib::Server::HandlerResponse::Handled;
        });
    server.Get("/", [](const httplib::Request&, httplib::Response& response) {
      response.set_content(LivePage(), "text/html; charset=utf-8");
    });
    server.Get("/map.json", [this](const httplib::Request&, httplib::Response& response) {
      const PageFeed::Text map = feed->map();
      if (map)
        response.set_content(*map, "application/json");
      else
        response.status = 204;
    });
    server.Get("/events",
               [this](const httplib::Request&, httplib::Response& response) { Follow(&response); });
    if (address.port == 0)
      port = server.bind_to_any_port(address.host);
    else if (server.bind_to_port(address.host, address.port))
      port = address.port;
    if (port <= 0)
      throw std::runtime_error(address.host + ":" + std::to_string(address.port) + ": " +
                               std::strerror(errno));
    thread = std::thread([this] {
      server.listen_after_bind();
      ended = true;
    });
  }

  ~Impl() {
    feed->Close();
    // stop() does nothing before the thread listens.
    while (!server.is_running() && !ended)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    server.stop();
    thread.join();
  }

  void Refuse(int status, httplib::Response* response) {
    ++refused;
    response->status = status;
  }

  void Follow(httplib::Response* response) {
    if (clients.fetch_add(1) >= kMostClients) {
      --clients;
      Refuse(503, response);
      return;
    }
    response->set_chunked_content_provider(
        "text/event-stream",
        [this, seen = std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
          const PageFeed::Text state = feed->WaitForState(&seen, kBeat);
          if (feed->is_closed()) return false;
          const std::string event = state ? EventOf(*state) : ":\n\n";
          return sink.write(event.data(), event.size());
        },
        [this](bool) { --clients; });
  }

  PageFeed* const feed;
  httplib::Server server;
  int port = -1;
  std::atomic<int> clients{0};
  std::atomic<std::int64_t> refused{0};
  std::atomic<bool> ended{false};
  std::thread thread;
};

PageServer::PageServer(const ListenAddress& address, PageFeed* feed)
    : impl_(std::make_unique<Impl>(address, feed)) {}
PageServer::~PageServer() = default;
int PageServer::port() const { return impl_->port; }
int PageServer::clients() const { return std::max(0, impl_->clients.load()); }
std::int64_t PageServer::refused() const { return impl_->refused; }

}  // namespace seastitch
