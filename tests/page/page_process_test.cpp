// seastitch-page as people start it: a real process, a real bus, and a browser.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sysexits.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/convert/convert.hpp"
#include "common/runtime/files/dive_folder.hpp"
#include "common/runtime/health.hpp"
#include "mapper/submaps/survey_store.hpp"
#include "tests/drivers/driver_process.hpp"
#include "tests/support/run_command.hpp"

namespace seastitch {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::string kHostile = "</script><img src=x onerror=\"broken=1\"><script>broken=1</script>";

Submap Square(int id, double north) {
  Submap submap;
  submap.id = SubmapId{id};
  submap.start = FromUtime(1'000'000LL * (90 + 10 * id));
  submap.frame_time = submap.end = FromUtime(1'000'000LL * (100 + 10 * id));
  submap.T_map_submap = MakePose({north, 0.0, 5.0}, Eigen::Matrix3d::Identity());
  for (float x = -10.0f; x <= 10.0f; x += 0.5f)
    for (float y = -10.0f; y <= 10.0f; y += 0.5f) submap.cloud.Add({x, y, 15.0f + 0.1f * x});
  submap.footprint = {{-10, -10}, {10, -10}, {10, 10}, {-10, 10}};
  return submap;
}

class PageProcess : public DriverProcess {
 protected:
  void SetUp() override {
    if (!OpenBus()) GTEST_SKIP() << "LCM cannot open " << lcm_url;
    bus->Subscribe<health_t>("HEALTH", 0, [this](const health_t& m) {
      if (m.process == "page") health = m;
    });
    std::filesystem::create_directory(dives());
  }
  std::filesystem::path dives() const { return dir.path() / "dives"; }
  std::unique_ptr<Process> StartPage(const std::string& keys = "listen: 127.0.0.1:0\n") {
    return Start("seastitch-page", dir.Write("page.yaml", "dives_dir: dives\n" + keys));
  }
  // Waits until it says where it listens.
  int Port() {
    const std::string before = "at port ";
    HandleUntil([&] { return health.text.find(before) != std::string::npos; }, 20'000);
    const std::size_t at = health.text.find(before);
    return at == std::string::npos ? 0 : std::atoi(health.text.c_str() + at + before.size());
  }
  void Send(const Submap& submap) {
    const SubmapMessages messages = ToLcm(submap, seq, seq);
    ++seq;
    bus->Publish("SUBMAP", messages.announcement);
    for (const submap_points_t& chunk : messages.chunks) bus->Publish("SUBMAP_POINTS", chunk);
  }
  void SendHealth(const std::string& process, const std::string& text) {
    health_t msg{};
    msg.process = process;
    msg.version = text;
    msg.seq = seq++;
    msg.state = health_t::STATE_DEGRADED;
    msg.text = text;
    condition_t fault{};
    fault.name = "disk_stalled";
    fault.sentence = text;
    msg.conditions = {fault};
    msg.num_conditions = 1;
    msg.rate_names = {text};
    msg.rate_hz = {1.0};
    msg.num_rates = 1;
    bus->Publish("HEALTH", msg);
  }
  void SendNav() {
    CorrectedNavState corrected;
    corrected.state.time = FromUtime(NowUtime());
    corrected.state.T_map_vehicle = MakePose({12.0, -3.0, 30.0}, Eigen::Matrix3d::Identity());
    corrected.state.covariance.diagonal() << 4.0, 12.0, 0.01, 1e-6, 1e-6, 1e-4;
    bus->Publish("NAV_CORRECTED", ToLcm(corrected, seq++));
    corrected.state.T_map_vehicle.translation().x() = 14.0;
    bus->Publish("NAV", ToLcm(corrected.state, seq++));
  }
  // The map, once it has so many submaps.
  json MapWith(int port, std::size_t submaps) {
    json map;
    HandleUntil(
        [&] {
          const auto answer = httplib::Client("127.0.0.1", port).Get("/map.json");
          if (!answer || answer->status != 200) return false;
          map = json::parse(answer->body);
          return map["submaps"].size() >= submaps;
        },
        20'000);
    return map;
  }

  health_t health{};
  std::int64_t seq = 1;
};

TEST_F(PageProcess, AnAddressThatIsNoneEndsItWithOneLine) {
  const auto process = StartPage("listen: everywhere\n");
  EXPECT_EQ(process->Wait(), EX_CONFIG);
  EXPECT_THAT(process->Output(), HasSubstr("page.yaml: listen: 'everywhere': expected"));
  EXPECT_EQ(process->Output().find('\n'), process->Output().size() - 1);
}

TEST_F(PageProcess, ShowsTheMapAsItGrows) {
  const auto process = StartPage();
  const int port = Port();
  ASSERT_GT(port, 0) << process->Output();
  for (const int id : {0, 1}) Send(Square(id, 25.0 * id));
  EXPECT_EQ(MapWith(port, 2)["submaps"].size(), 2u) << health.text;
  PoseGraph solution;
  solution.graph_version = 1;
  solution.vertices = {{SubmapId{0}, {0.0, 0.0, 0.0}}, {SubmapId{1}, {25.0, 6.0, 0.0}}};
  solution.loop_edges = {{SubmapId{0}, SubmapId{1}, 1.0}};
  for (const pose_graph_t& part : ToLcm(solution, 1, FromUtime(1), 1))
    bus->Publish("POSE_GRAPH", part);
  ASSERT_TRUE(HandleUntil([&] { return MapWith(port, 2)["closures"].size() == 1; }, 20'000));
  EXPECT_EQ(MapWith(port, 2)["closures"][0]["line"], json({0.0, 0.0, 25.0, 6.0}));
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// Started late, it has the submaps that the mapper keeps; a damaged one is left out.
TEST_F(PageProcess, StartedLateItReadsTheDive) {
  const DiveFolder dive({.dives_dir = dives()}, "mapper", NowUtime());
  SurveyStore store({.directory = dive.map()});
  for (const int id : {0, 1, 2}) store.Put(std::make_shared<const Submap>(Square(id, 25.0 * id)));
  for (const auto& entry : std::filesystem::recursive_directory_iterator(dive.map()))
    if (entry.path().filename() == SubmapFileName(SubmapId{1}))
      std::filesystem::resize_file(entry.path(), 700);
  const auto process = StartPage();
  const int port = Port();
  ASSERT_GT(port, 0) << process->Output();
  EXPECT_EQ(MapWith(port, 2)["submaps"].size(), 2u) << process->Output();
  Send(Square(1, 25.0));
  EXPECT_EQ(MapWith(port, 3)["submaps"].size(), 3u) << "the bus has it whole";
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// Names of processes and all that they say come from the bus.
TEST_F(PageProcess, TextFromTheVehicleBecomesTextInTheBrowser) {
  const auto process = StartPage();
  const int port = Port();
  ASSERT_GT(port, 0) << process->Output();
  Send(Square(0, 0.0));
  MapWith(port, 1);
  std::thread sends;
  std::atomic<bool> ends{false};
  sends = std::thread([&] {
    while (!ends) {
      SendHealth(kHostile, kHostile);
      SendHealth("mapper", "a mapper");
      SendNav();
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
  });
  const auto run = RunCommand("HOME=" + dir.path().string() + " /usr/bin/python3 " +
                              (SourceDir() / "tests/page/page_in_browser.py").string() +
                              " http://127.0.0.1:" + std::to_string(port) + "/ 2>/dev/null");
  ends = true;
  sends.join();
  if (run.exit_code == 77) GTEST_SKIP() << "no Chromium here";
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const json seen = json::parse(run.output);
  EXPECT_EQ(seen["images"], 0);
  EXPECT_EQ(seen["scripts"], 2);
  EXPECT_EQ(seen["broken"], false);
  EXPECT_TRUE(seen["errors"].empty()) << seen["errors"];
  EXPECT_LE(seen["too_wide_px"], 0);
  const json& texts = seen["texts"];
  EXPECT_THAT(std::string(texts["processes"]), HasSubstr(kHostile));
  EXPECT_THAT(std::string(texts["faults"]), HasSubstr("Check the data disk")) << "the remedy";
  EXPECT_EQ(texts["place"], "\u00b1 4.0 m");
  EXPECT_EQ(texts["depth"], "30.0 m");
  EXPECT_EQ(texts["submaps"], "1, 0");
  EXPECT_THAT(std::string(texts["navigation"]), HasSubstr("14.0 m"));
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

// Any number of names, and messages that are damaged.
TEST_F(PageProcess, AFloodOnTheBusIsBounded) {
  const auto process = StartPage();
  const int port = Port();
  ASSERT_GT(port, 0) << process->Output();
  for (int i = 0; i < 3000; ++i) {
    SendHealth("name" + std::to_string(i), std::string(200, 'x'));
    if (i % 100 == 0) HandleUntil([] { return false; }, 5);
  }
  SubmapMessages messages = ToLcm(Square(0, 0.0), 1, 1);
  messages.chunks.back().x_m.back() += 1.0f;
  bus->Publish("SUBMAP", messages.announcement);
  for (const submap_points_t& chunk : messages.chunks) bus->Publish("SUBMAP_POINTS", chunk);
  // Again and again: a flood may cost it as well.
  const std::jthread last([this](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(std::chrono::milliseconds(100)))
      SendHealth("last", "the last");
  });
  std::string event;
  std::size_t largest = 0;
  bool is_heard = false;
  httplib::Client client("127.0.0.1", port);
  client.Get("/events", [&](const char* data, std::size_t n) {
    event.append(data, n);
    largest = std::max(largest, event.size());
    is_heard = event.find("the last") != std::string::npos;
    if (event.ends_with("\n\n")) event.clear();
    return !is_heard;
  });
  EXPECT_TRUE(is_heard);
  EXPECT_LT(largest, 150'000u);
  EXPECT_EQ(client.Get("/map.json")->status, 204);
  EXPECT_EQ(process->Stop(), EXIT_SUCCESS) << process->Output();
}

}  // namespace
}  // namespace seastitch
