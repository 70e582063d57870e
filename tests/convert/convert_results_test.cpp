#include "common/convert/convert.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/convert/damage.hpp"
#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

using namespace examples;

TEST(ConvertNav, GivesBackTheState) {
  const auto back = FromLcm(Wire(ToLcm(Nav(), 7)));
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->T_map_vehicle.isApprox(Nav().T_map_vehicle, 1e-14));
  EXPECT_EQ(back->v_map_mps, Nav().v_map_mps);
  EXPECT_EQ(back->covariance, Nav().covariance);
  EXPECT_TRUE(back->bottom_lock);
}

TEST(ConvertNav, RefusesEachDamage) {
  using M = nav_t;
  ExpectEachRefused<M>(
      ToLcm(Nav(), 7),
      {{"position NaN", [](M& m) { m.p_map_vehicle_m[1] = kNan; }},
       {"position beyond the Earth", [](M& m) { m.p_map_vehicle_m[1] = 1e9; }},
       {"quaternion zero", [](M& m) { std::fill_n(m.q_map_vehicle, 4, 0.0); }},
       {"velocity NaN", [](M& m) { m.v_map_mps[1] = kNan; }},
       {"covariance NaN", [](M& m) { m.covariance_ned_rpy[2][3] = kNan; }},
       {"covariance not symmetric", [](M& m) { m.covariance_ned_rpy[0][5] = 0.1; }},
       {"variance negative", [](M& m) { m.covariance_ned_rpy[3][3] = -1e-9; }}});
}

TEST(ConvertNavCorrected, GivesBackTheStateAndRefusesEachDamage) {
  const auto back = FromLcm(Wire(ToLcm(Corrected(), 7)));
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->state.T_map_vehicle.isApprox(Nav().T_map_vehicle, 1e-14));
  EXPECT_EQ(back->state.covariance, Nav().covariance);
  EXPECT_EQ(back->T_map_nav.Vector(), Corrected().T_map_nav.Vector());
  EXPECT_EQ(back->graph_version, 5);
  EXPECT_EQ(back->jumps, 3);
  EXPECT_EQ(back->last_jump_m, 0.4);
  EXPECT_EQ(back->last_jump_yaw_rad, -0.01);
  using M = nav_corrected_t;
  ExpectEachRefused<M>(ToLcm(Corrected(), 7),
                       {{"time", [](M& m) { m.utime = -1; }},
                        {"quaternion zero", [](M& m) { std::fill_n(m.q_map_vehicle, 4, 0.0); }},
                        {"variance negative", [](M& m) { m.covariance_ned_rpy[3][3] = -1e-9; }},
                        {"velocity NaN", [](M& m) { m.v_map_mps[1] = kNan; }},
                        {"correction NaN", [](M& m) { m.correction_yaw_rad = kNan; }},
                        {"correction beyond the Earth", [](M& m) { m.correction_x_m = 1e9; }},
                        {"version negative", [](M& m) { m.graph_version = -1; }},
                        {"jumps negative", [](M& m) { m.jumps = -1; }},
                        {"jump negative", [](M& m) { m.last_jump_m = -1.0; }},
                        {"jump NaN", [](M& m) { m.last_jump_yaw_rad = kNan; }}});
}

TEST(ConvertGraphUpdate, GivesBackTheUpdate) {
  const auto back = FromLcm(Wire(ToLcm(Update(), kTime, 9)));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->version, 3);
  EXPECT_EQ(back->graph_id, Update().graph_id);
  EXPECT_TRUE(back->final);
  EXPECT_TRUE(back->resumed);
  ASSERT_EQ(back->vertices.size(), 1u);
  EXPECT_EQ(back->vertices[0].chain, 1);
  EXPECT_EQ(back->vertices[0].id, SubmapId{4});
  EXPECT_EQ(back->vertices[0].dead_reckoned.Vector(), Eigen::Vector3d(10.0, 20.0, 0.5));
  EXPECT_EQ(back->vertices[0].heading_sigma_rad, 0.02);
  ASSERT_EQ(back->edges.size(), 2u);
  const GraphEdge& loop = back->edges[0];
  EXPECT_EQ(loop.kind, EdgeKind::kLoopClosure);
  EXPECT_EQ(loop.from, SubmapId{1});
  EXPECT_EQ(loop.to, SubmapId{4});
  EXPECT_EQ(loop.T_from_to.Vector(), Eigen::Vector3d(1.0, -2.0, 3.0));
  EXPECT_EQ(loop.information, Update().edges[0].information);
  EXPECT_EQ(loop.verdict, LoopVerdict::kPoorFit);
  EXPECT_EQ(loop.z_offset_m, -0.1);
  EXPECT_EQ(loop.rms_m, 0.05);
  EXPECT_EQ(loop.overlap_m2, 300.0);
  EXPECT_EQ(loop.overlap_center_m, Eigen::Vector2d(12.0, -7.0));
  EXPECT_EQ(back->mounting.sonar_m, 0.25);
  EXPECT_EQ(back->mounting.dvl_yaw_rad, 0.004);
  EXPECT_EQ(back->edges[1].kind, EdgeKind::kPositionFix);
}

TEST(ConvertGraphUpdate, AHeadingThatIsNotKnownStaysSo) {
  GraphUpdate update = Update();
  update.vertices[0].heading_sigma_rad.reset();
  const auto back = FromLcm(Wire(ToLcm(update, kTime, 9)));
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->vertices[0].heading_sigma_rad);
}

TEST(ConvertGraphUpdate, StaysUnderOneDatagramAtItsLargest) {
  GraphUpdate update;
  update.version = 1;
  for (int i = 0; i < kMaxVerticesPerUpdate; ++i)
    update.vertices.push_back({SubmapId{i}, kTime, {}, 0.0});
  update.edges.assign(kMaxEdgesPerUpdate, Update().edges[0]);
  const graph_update_t msg = ToLcm(update, kTime, 0);
  EXPECT_LT(msg.getEncodedSize(), 60'000);
  EXPECT_TRUE(FromLcm(msg));
}

TEST(ConvertGraphUpdate, RefusesEachDamage) {
  using M = graph_update_t;
  ExpectEachRefused<M>(
      ToLcm(Update(), kTime, 9),
      {{"version zero", [](M& m) { m.version = 0; }},
       {"kind unknown", [](M& m) { m.edges[0].kind = 3; }},
       {"kind negative", [](M& m) { m.edges[0].kind = -1; }},
       {"verdict unknown", [](M& m) { m.edges[0].verdict = 7; }},
       {"id negative", [](M& m) { m.edges[0].from_id = -1; }},
       {"vertex id negative", [](M& m) { m.vertices[0].id = -1; }},
       {"chain negative", [](M& m) { m.vertices[0].chain = -1; }},
       {"vertex NaN", [](M& m) { m.vertices[0].dead_reckoned_yaw_rad = kNan; }},
       {"heading sigma negative", [](M& m) { m.vertices[0].heading_sigma_rad = -1e-9; }},
       {"loop on itself", [](M& m) { m.edges[0].to_id = 1; }},
       {"fix on two", [](M& m) { m.edges[1].to_id = 1; }},
       {"pose NaN", [](M& m) { m.edges[0].x_m = kNan; }},
       {"information NaN", [](M& m) { m.edges[0].information[1][1] = kNan; }},
       {"information not symmetric", [](M& m) { m.edges[0].information[0][1] = 2.0; }},
       {"information negative", [](M& m) { m.edges[0].information[2][2] = -1.0; }},
       {"rms NaN", [](M& m) { m.edges[0].rms_m = kNan; }},
       {"overlap nowhere", [](M& m) { m.edges[0].overlap_center_y_m = kNan; }},
       {"sonar sigma negative", [](M& m) { m.sonar_sigma_m = -0.1; }},
       {"DVL sigma NaN", [](M& m) { m.dvl_yaw_sigma_rad = kNan; }},
       {"count above the list", [](M& m) { m.num_edges = 3; }},
       {"count negative", [](M& m) { m.num_vertices = -1; }}});
}

TEST(ConvertPoseGraph, ComesBackFromItsParts) {
  for (const auto& [vertices, edges] : {std::pair{0, 0}, {1, 0}, {251, 10}, {600, 1700}}) {
    const PoseGraph graph = Graph(vertices, edges);
    const std::vector<pose_graph_t> parts = ToLcm(graph, 8, kTime, 100);
    PoseGraphAssembler assembler;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_LT(parts[i].getEncodedSize(), 60'000);
      EXPECT_EQ(parts[i].seq, 100 + static_cast<int>(i));
      const auto whole = assembler.Add(Wire(parts[i]));
      ASSERT_EQ(whole.has_value(), i + 1 == parts.size());
      if (!whole) continue;
      EXPECT_EQ(whole->graph_version, 5);
      EXPECT_EQ(whole->graph_id, graph.graph_id);
      ASSERT_EQ(whole->mounting.size(), 1u);
      EXPECT_EQ(whole->MountingOf(0).Vector(), Eigen::Vector3d(0.3, -0.1, 0.002));
      EXPECT_EQ(whole->MountingOf(0).covariance, graph.MountingOf(0).covariance);
      ASSERT_EQ(whole->vertices.size(), graph.vertices.size());
      for (std::size_t k = 0; k < graph.vertices.size(); ++k) {
        EXPECT_EQ(whole->vertices[k].T_map_level.Vector(), graph.vertices[k].T_map_level.Vector());
        EXPECT_EQ(whole->vertices[k].covariance, graph.vertices[k].covariance);
        EXPECT_EQ(whole->vertices[k].covariance_with_newest,
                  graph.vertices[k].covariance_with_newest);
      }
      ASSERT_EQ(whole->loop_edges.size(), graph.loop_edges.size());
      for (std::size_t k = 0; k < graph.loop_edges.size(); ++k)
        EXPECT_EQ(whole->loop_edges[k].weight, graph.loop_edges[k].weight);
    }
    EXPECT_EQ(assembler.malformed(), 0);
  }
}

// Their errors come in parts, too.
TEST(ConvertPoseGraph, OfManyDivesComesBackFromItsParts) {
  PoseGraph graph = Graph(250, 500);
  graph.mounting.clear();
  for (int chain = 0; chain < 120; ++chain)
    graph.mounting[3 * chain] = {{0.01 * chain, -0.02}, 0.001, Eigen::Matrix3d::Identity()};
  const std::vector<pose_graph_t> parts = ToLcm(graph, 8, kTime, 100);
  ASSERT_EQ(parts.size(), 3u);
  PoseGraphAssembler assembler;
  EXPECT_LT(parts[0].getEncodedSize(), 60'000);
  EXPECT_FALSE(assembler.Add(Wire(parts[0])));
  EXPECT_FALSE(assembler.Add(Wire(parts[1])));
  const auto whole = assembler.Add(Wire(parts[2]));
  ASSERT_TRUE(whole);
  ASSERT_EQ(whole->mounting.size(), 120u);
  for (const auto& [chain, errors] : graph.mounting)
    EXPECT_EQ(whole->MountingOf(chain).Vector(), errors.Vector()) << chain;
  EXPECT_EQ(whole->MountingOf(1).Vector(), Eigen::Vector3d::Zero()) << "not estimated";
}

TEST(ConvertPoseGraph, WithAPartMissingIsNoGraphAndTheNextOneIs) {
  const auto parts = ToLcm(Graph(600, 0), 1, kTime, 0);
  ASSERT_EQ(parts.size(), 3u);
  PoseGraphAssembler assembler;
  EXPECT_FALSE(assembler.Add(parts[0]));
  EXPECT_FALSE(assembler.Add(parts[2]));
  EXPECT_EQ(assembler.malformed(), 1);
  EXPECT_FALSE(assembler.Add(parts[0]));
  const auto next = ToLcm(Graph(2, 1), 2, kTime, 3);
  EXPECT_TRUE(assembler.Add(next[0])) << "a newer solution ends the unfinished one";
  EXPECT_EQ(assembler.malformed(), 2);
}

TEST(ConvertPoseGraph, NeverMixesTwoSolutions) {
  const auto first = ToLcm(Graph(300, 0), 1, kTime, 0);
  const auto second = ToLcm(Graph(300, 0), 2, kTime, 2);
  PoseGraphAssembler assembler;
  EXPECT_FALSE(assembler.Add(first[0]));
  EXPECT_FALSE(assembler.Add(second[1]));
  EXPECT_EQ(assembler.malformed(), 1);
}

TEST(ConvertPoseGraph, RefusesEachDamage) {
  const std::vector<Damage<pose_graph_t>> damages{
      {"ids not rising", [](pose_graph_t& m) { m.vertices[1].id = 0; }},
      {"id negative", [](pose_graph_t& m) { m.vertices[0].id = -1; }},
      {"pose NaN", [](pose_graph_t& m) { m.vertices[0].yaw_rad = kNan; }},
      {"covariance negative", [](pose_graph_t& m) { m.vertices[0].covariance[0][0] = -1; }},
      {"cross NaN", [](pose_graph_t& m) { m.vertices[0].covariance_with_newest[2][2] = kNan; }},
      {"weight above one", [](pose_graph_t& m) { m.loop_edges[0].weight = 1.1; }},
      {"weight NaN", [](pose_graph_t& m) { m.loop_edges[0].weight = kNan; }},
      {"sonar nowhere", [](pose_graph_t& m) { m.mountings[0].sonar_forward_m = kNan; }},
      {"DVL turned by NaN", [](pose_graph_t& m) { m.mountings[0].dvl_yaw_rad = kNan; }},
      {"covariance of mounting not symmetric",
       [](pose_graph_t& m) { m.mountings[0].covariance[0][1] = 1.0; }},
      {"mounting of no dive", [](pose_graph_t& m) { m.mountings[0].chain = -1; }},
      {"mounting of one dive twice",
       [](pose_graph_t& m) {
         m.mountings.push_back(m.mountings[0]);
         m.num_mountings = 2;
       }},
      {"no parts", [](pose_graph_t& m) { m.num_parts = 0; }},
      {"endless parts", [](pose_graph_t& m) { m.num_parts = 1 << 30; }},
      {"part negative", [](pose_graph_t& m) { m.part = -1; }}};
  for (const auto& damage : damages) {
    pose_graph_t msg = ToLcm(Graph(2, 1), 0, kTime, 0)[0];
    damage.apply(msg);
    PoseGraphAssembler assembler;
    EXPECT_FALSE(assembler.Add(msg)) << damage.name;
    EXPECT_EQ(assembler.malformed(), 1) << damage.name;
  }
}

TEST(ConvertCovariances, RequestAndAnswerComeBack) {
  for (const int pairs : {0, 1, kMaxCovariancePairs}) {
    const covariance_request_t asked = ToLcm(Request(pairs), kTime);
    EXPECT_EQ(asked.seq, 3);
    EXPECT_EQ(asked.utime, ToUtime(kTime));
    const auto request = FromLcm(Wire(asked));
    ASSERT_TRUE(request);
    EXPECT_EQ(request->sender, "mapper");
    EXPECT_EQ(request->seq, 3);
    EXPECT_EQ(request->graph_version, 7);
    EXPECT_EQ(request->graph_id, Request(0).graph_id);
    EXPECT_EQ(request->pairs, Request(pairs).pairs);

    const covariances_t answered = ToLcm(Answer(pairs), kTime, 3);
    EXPECT_LT(answered.getEncodedSize(), 60'000);
    const auto answer = FromLcm(Wire(answered));
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->recipient, "mapper");
    EXPECT_EQ(answer->request_seq, 3);
    EXPECT_EQ(answer->graph_version, 7);
    EXPECT_EQ(answer->graph_id, Answer(0).graph_id);
    ASSERT_EQ(answer->pairs.size(), static_cast<std::size_t>(pairs));
    for (int k = 0; k < pairs; ++k) {
      const PairCovariance& pair = answer->pairs[static_cast<std::size_t>(k)];
      EXPECT_EQ(pair.b, SubmapId{2 * k + 1});
      EXPECT_EQ(pair.covariance, Answer(pairs).pairs[static_cast<std::size_t>(k)].covariance);
    }
  }
}

TEST(ConvertCovariances, RefuseEachDamage) {
  using Request_t = covariance_request_t;
  ExpectEachRefused<Request_t>(
      ToLcm(Request(2), kTime),
      {{"no version", [](Request_t& m) { m.graph_version = 0; }},
       {"time", [](Request_t& m) { m.utime = -1; }},
       {"count above the lists", [](Request_t& m) { m.num_pairs = 3; }},
       {"count negative", [](Request_t& m) { m.num_pairs = -1; }},
       {"lists of two lengths", [](Request_t& m) { m.b_id.pop_back(); }},
       {"a name without end", [](Request_t& m) { m.sender = std::string(65, 'x'); }},
       {"too many", [](Request_t& m) {
          m.num_pairs = kMaxCovariancePairs + 1;
          m.a_id.resize(kMaxCovariancePairs + 1);
          m.b_id.resize(kMaxCovariancePairs + 1);
        }}});
  using Answer_t = covariances_t;
  ExpectEachRefused<Answer_t>(
      ToLcm(Answer(2), kTime, 0),
      {{"no version", [](Answer_t& m) { m.graph_version = 0; }},
       {"time", [](Answer_t& m) { m.utime = -1; }},
       {"id negative", [](Answer_t& m) { m.pairs[1].a_id = -1; }},
       {"variance negative", [](Answer_t& m) { m.pairs[0].covariance[1][1] = -1.0; }},
       {"not symmetric", [](Answer_t& m) { m.pairs[0].covariance[0][1] = 0.5; }},
       {"NaN", [](Answer_t& m) { m.pairs[1].covariance[2][2] = kNan; }},
       {"count above the list", [](Answer_t& m) { m.num_pairs = 3; }},
       {"count negative", [](Answer_t& m) { m.num_pairs = -1; }},
       {"a name without end", [](Answer_t& m) { m.recipient = std::string(65, 'x'); }},
       {"too many", [](Answer_t& m) {
          m.num_pairs = kMaxCovariancePairs + 1;
          m.pairs.resize(kMaxCovariancePairs + 1, m.pairs[0]);
        }}});
}

}  // namespace
}  // namespace seastitch
