#include "page/page_server.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace seastitch {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

// A client that says and reads what it likes.
class RawClient {
 public:
  explicit RawClient(int port, int receive_buffer_bytes = 0)
      : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_buffer_bytes > 0)
      setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    const timeval patience{10, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~RawClient() { close(fd_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void Say(const std::string& text) { send(fd_, text.data(), text.size(), MSG_NOSIGNAL); }
  // Until `done`, or the end of the connection.
  std::string ReadUntil(const std::function<bool(const std::string&)>& done) {
    std::string text;
    char bytes[4096];
    while (!done(text)) {
      const ssize_t n = recv(fd_, bytes, sizeof bytes, 0);
      if (n <= 0) break;
      text.append(bytes, static_cast<std::size_t>(n));
    }
    return text;
  }
  std::string StatusLine() {
    const std::string answer =
        ReadUntil([](const std::string& text) { return text.find("\r\n") != std::string::npos; });
    return answer.substr(0, answer.find("\r\n"));
  }

 private:
  const int fd_;
};

class PageServerTest : public testing::Test {
 protected:
  std::string Ask(const std::string& request_line, const std::string& host = "localhost") {
    RawClient client(server.port());
    client.Say(request_line + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
    return client.StatusLine();
  }
  std::unique_ptr<RawClient> Follow() {
    auto client = std::make_unique<RawClient>(server.port());
    client->Say("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    return client;
  }
  template <class Done>
  bool Until(Done done, milliseconds at_most) {
    const auto end = std::chrono::steady_clock::now() + at_most;
    while (!done()) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(milliseconds(5));
    }
    return true;
  }

  PageFeed feed;
  PageServer server{{"127.0.0.1", 0}, &feed};
};

TEST(ListenAddress, IsAnAddressAndAPort) {
  const ListenAddress address = ParseListenAddress("127.0.0.1:8642");
  EXPECT_EQ(address.host, "127.0.0.1");
  EXPECT_EQ(address.port, 8642);
  EXPECT_TRUE(IsLoopback(address));
  EXPECT_FALSE(IsLoopback(ParseListenAddress("0.0.0.0:80")));
  for (const char* const text : {"",
                                 "8642",
                                 "127.0.0.1",
                                 "127.0.0.1:",
                                 "127.0.0.1:x",
                                 "127.0.0.1:70000",
                                 "127.0.0.1:-1",
                                 "localhost:80",
                                 "127.0.0.1:80 ",
                                 ":80"})
    EXPECT_THROW(ParseListenAddress(text), std::runtime_error) << text;
}

TEST_F(PageServerTest, AnswersItsThreeUrls) {
  httplib::Client client("127.0.0.1", server.port());
  const auto page = client.Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->body, HasSubstr("<canvas"));
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"), HasSubstr("default-src 'none'"));
  EXPECT_EQ(client.Get("/map.json")->status, 204) << "no map yet";
  feed.SetMap("{\"cell_m\": 1}");
  EXPECT_EQ(client.Get("/map.json")->body, "{\"cell_m\": 1}");
  feed.SetState("{\n\"a\": 1}");
  const std::string events = Follow()->ReadUntil(
      [](const std::string& text) { return text.find("\n\n") != std::string::npos; });
  EXPECT_THAT(events, HasSubstr("text/event-stream"));
  EXPECT_THAT(events, HasSubstr("data: {\ndata: \"a\": 1}\n\n"));
}

TEST_F(PageServerTest, RefusesEverythingElse) {
  const std::vector<std::pair<std::string, std::string>> asked{{"GET /nothing", "404"},
                                                               {"GET /../etc/passwd", "404"},
                                                               {"GET /%2e%2e/etc/passwd", "404"},
                                                               {"GET //etc/passwd", "404"},
                                                               {"GET /map.json/..", "404"},
                                                               {"POST /", "405"},
                                                               {"PUT /map.json", "405"},
                                                               {"DELETE /", "405"},
                                                               {"HEAD /", "405"},
                                                               {"OPTIONS *", "405"}};
  for (const auto& [request, status] : asked)
    EXPECT_THAT(Ask(request), HasSubstr(status)) << request;
  for (const char* const host : {"evil.example", "127.0.0.1.evil.example", "localhost.evil", ""})
    EXPECT_THAT(Ask("GET /", host), HasSubstr("421")) << host;
  for (const char* const host :
       {"localhost", "localhost:9000", "127.0.0.1:8642", "[::1]:80", "10.0.0.7"})
    EXPECT_THAT(Ask("GET /", host), HasSubstr("200")) << host;
  EXPECT_GE(server.refused(), 9);
}

TEST_F(PageServerTest, ABodyIsNotRead) {
  RawClient client(server.port());
  client.Say("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\n");
  EXPECT_THAT(client.StatusLine(), HasSubstr("405"));
  const std::string kilobyte(1000, 'x');
  for (int i = 0; i < 1000; ++i) client.Say(kilobyte);
  EXPECT_THAT(Ask("GET /"), HasSubstr("200"));
}

TEST_F(PageServerTest, LinesWithoutEndAndNonsenseEndTheConnection) {
  for (const std::string& text : {std::string(100'000, 'a'),
                                  "GET / HTTP/1.1\r\n" + std::string(100'000, 'h') + ": x\r\n\r\n",
                                  std::string("\0\xff\r\n\r\n", 6),
                                  std::string("GET / HTTP/9.9\r\n\r\n")}) {
    RawClient client(server.port());
    client.Say(text);
    EXPECT_THAT(client.StatusLine(), testing::Not(HasSubstr("200"))) << text.substr(0, 20);
  }
  EXPECT_THAT(Ask("GET /"), HasSubstr("200"));
}

TEST_F(PageServerTest, EightFollowAndTheNinthIsTurnedAway) {
  std::vector<std::unique_ptr<RawClient>> followers;
  for (int i = 0; i < PageServer::kMostClients; ++i) followers.push_back(Follow());
  ASSERT_TRUE(Until([&] { return server.clients() == PageServer::kMostClients; }, seconds(10)));
  EXPECT_THAT(Ask("GET /events"), HasSubstr("503"));
  EXPECT_THAT(Ask("GET /"), HasSubstr("200")) << "requests are answered beside them";
  followers.clear();
  feed.SetState("{}");
  EXPECT_TRUE(Until(
      [&] {
        feed.SetState("{}");  // one that is gone is found with the next state
        return server.clients() == 0;
      },
      seconds(20)));
}

TEST_F(PageServerTest, ConnectionsThatSayNothingDoNotKeepOthersOut) {
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 200; ++i) idle.push_back(std::make_unique<RawClient>(server.port()));
  httplib::Client client("127.0.0.1", server.port());
  client.set_read_timeout(60);
  client.set_connection_timeout(60);
  const auto page = client.Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
}

TEST_F(PageServerTest, BrowsersThatDoNotReadAreDropped) {
  feed.SetMap(std::string(20'000'000, '1'));
  std::vector<std::unique_ptr<RawClient>> stalled;
  for (int i = 0; i < 2 * PageServer::kMostClients; ++i) {
    stalled.push_back(std::make_unique<RawClient>(server.port(), 4096));
    stalled.back()->Say("GET /map.json HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  httplib::Client client("127.0.0.1", server.port());
  client.set_read_timeout(60);
  const auto page = client.Get("/");
  ASSERT_TRUE(page) << "all threads wait for them";
  EXPECT_EQ(page->status, 200);
}

// As a process that ends has it: with browsers that follow, and before a first one.
TEST(PageServer, EndsAtOnce) {
  for (const int followers : {0, 3}) {
    PageFeed feed;
    auto server = std::make_unique<PageServer>(ListenAddress{"127.0.0.1", 0}, &feed);
    std::vector<std::unique_ptr<RawClient>> clients;
    for (int i = 0; i < followers; ++i) {
      clients.push_back(std::make_unique<RawClient>(server->port()));
      clients.back()->Say("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    }
    while (server->clients() < followers) std::this_thread::sleep_for(milliseconds(1));
    server.reset();
  }
}

TEST(PageServer, APortThatIsTakenIsNamed) {
  PageFeed feed;
  const PageServer first({"127.0.0.1", 0}, &feed);
  try {
    const PageServer second({"127.0.0.1", first.port()}, &feed);
    ADD_FAILURE() << "it listens at a port that is taken";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("127.0.0.1:" + std::to_string(first.port())));
  }
}

}  // namespace
}  // namespace seastitch
