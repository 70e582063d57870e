#include "mapper/loops/graph_log.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace seastitch {
namespace {

const Time kTime = FromUtime(5'000'000);

std::vector<GraphVertex> Vertices(int count) {
  std::vector<GraphVertex> vertices;
  for (int id = 0; id < count; ++id) vertices.push_back({SubmapId{id}, kTime, {}});
  return vertices;
}

// Numbered by their overlap.
std::vector<GraphEdge> Edges(int count) {
  std::vector<GraphEdge> edges(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) edges[static_cast<std::size_t>(i)].overlap_m2 = i;
  return edges;
}

TEST(GraphLog, SplitsWhatNoMessageHoldsAndKeepsTheOrder) {
  for (const int num_vertices : {0, 1, 199, 200, 201, 450}) {
    for (const int num_edges : {0, 1, 199, 200, 201, 400, 501}) {
      GraphLog log({0.3, 0.01});
      log.Append(Vertices(num_vertices), Edges(num_edges), kTime);
      int vertices = 0;
      int edges = 0;
      std::int64_t version = 0;
      while (const GraphStep* step = log.After(version)) {
        EXPECT_EQ(step->update.version, ++version);
        EXPECT_LE(step->update.vertices.size(), static_cast<std::size_t>(kMaxVerticesPerUpdate));
        EXPECT_LE(step->update.edges.size(), static_cast<std::size_t>(kMaxEdgesPerUpdate));
        EXPECT_EQ(step->update.mounting.sonar_m, 0.3);
        EXPECT_EQ(step->submap_time, kTime);
        for (const GraphVertex& v : step->update.vertices) EXPECT_EQ(v.id.value, vertices++);
        for (const GraphEdge& e : step->update.edges) {
          EXPECT_EQ(vertices, num_vertices) << "an edge before its vertex";
          EXPECT_EQ(e.overlap_m2, edges++);
        }
      }
      EXPECT_EQ(vertices, num_vertices);
      EXPECT_EQ(edges, num_edges);
      EXPECT_EQ(log.version(), version);
    }
  }
}

TEST(GraphLog, GivesAnyVersionAgain) {
  GraphLog log({});
  for (int i = 0; i < 4; ++i) log.Append(Vertices(1), {}, kTime);
  EXPECT_EQ(log.After(2)->update.version, 3);
  EXPECT_EQ(log.After(0)->update.version, 1);
  EXPECT_EQ(log.After(std::numeric_limits<std::int64_t>::min())->update.version, 1);
  EXPECT_EQ(log.After(4), nullptr);
  EXPECT_EQ(log.After(std::numeric_limits<std::int64_t>::max()), nullptr);
}

TEST(GraphLog, IsNamedOnceAndEndsOnce) {
  GraphLog log({});
  log.SetId(7);
  log.SetId(8);
  log.Append(Vertices(1), {}, kTime);
  EXPECT_FALSE(log.HasEnded());
  log.Append({}, Edges(201), kTime, true);
  EXPECT_TRUE(log.HasEnded());
  log.Append({}, Edges(1), kTime, true);  // a pair looked at again
  log.Append({}, {}, kTime, true);
  ASSERT_EQ(log.version(), 4);
  for (const std::int64_t version : {1, 2, 3, 4}) {
    const GraphUpdate& update = log.After(version - 1)->update;
    EXPECT_EQ(update.graph_id, 7);
    EXPECT_EQ(update.final, version == 3);
  }
}

TEST(GraphLog, EndsWithAnEmptyVersionWhereNothingIsLeft) {
  GraphLog log({});
  log.Append(Vertices(1), {}, kTime);
  log.Append({}, {}, kTime);
  EXPECT_EQ(log.version(), 1);
  log.Append({}, {}, kTime, true);
  ASSERT_EQ(log.version(), 2);
  EXPECT_TRUE(log.After(1)->update.final);
  EXPECT_TRUE(log.After(1)->update.vertices.empty());
}

TEST(GraphLog, OfImportedSubmapsIsNamedByTheFirst) {
  GraphLog log({});
  log.Append(Vertices(1), {}, kTime);
  log.SetId(9);
  EXPECT_EQ(log.graph_id(), ToUtime(kTime));
}

}  // namespace
}  // namespace seastitch
