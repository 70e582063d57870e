#include "mapper/loops/registration_job.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include "common/runtime/for_each_beside.hpp"
#include "tests/mapper/bumpy_submap.hpp"

namespace seastitch {
namespace {

std::vector<GraphEdge> EdgesOf(const Submap& source,
                               const std::vector<LoopPair>& pairs,
                               const LoadSubmap& load,
                               const LoopCloserParams& params,
                               PreparedSubmaps* prepared) {
  return Run({std::make_shared<const Submap>(source), pairs}, params, load, prepared).edges;
}

LoadSubmap Always(const Submap& target) {
  return [target](SubmapId) { return std::make_shared<const Submap>(target); };
}

TEST(Run, FindsWhereTheNewerSubmapLies) {
  const Submap target = At(0, 0.0, 0.0);
  // Dead reckoning puts it 1.2 m north and 0.9 m west of the truth.
  const Submap source = Make(1, {10.0, 12.0, 0.0}, {11.2, 11.1, 0.0});
  LoopCloser closer(LoopCloserParams{});
  closer.Add(target);
  closer.Add(source);
  const std::vector<LoopPair> pairs = closer.PairsFor(SubmapId{1});
  ASSERT_EQ(pairs.size(), 1u);
  PreparedSubmaps prepared({});
  const auto edges = EdgesOf(source, pairs, Always(target), {}, &prepared);
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].verdict, LoopVerdict::kAccepted) << ToString(edges[0].verdict);
  EXPECT_EQ(edges[0].from.value, 0);
  EXPECT_EQ(edges[0].to.value, 1);
  EXPECT_NEAR(edges[0].T_from_to.x, 10.0, 0.1);
  EXPECT_NEAR(edges[0].T_from_to.y, 12.0, 0.1);
}

// The older submap was built before navigation knew the Doppler log's angle, and is sheared by 2
// degrees: at the overlap, 20 m ahead of its middle, by 0.7 m.
TEST(Run, StraightensWhatWasBuiltByAnAngleThatIsKnownBetterNow) {
  const double learnt_rad = Deg2Rad(2.0);
  Submap target = At(0, 0.0, 0.0);
  for (Eigen::Vector3f& p : target.cloud.points) p.y() -= static_cast<float>(learnt_rad) * p.x();
  const auto x_y_of = [&](double known_rad) {
    Submap source = Make(1, {40.0, 0.0, 0.0}, {40.3, 0.2, 0.0});
    source.dvl_yaw_rad = known_rad;
    LoopCloser closer(LoopCloserParams{});
    closer.Add(target);
    closer.Add(source);
    PreparedSubmaps prepared({});
    const auto edges = EdgesOf(source, closer.PairsFor(SubmapId{1}), Always(target), {}, &prepared);
    EXPECT_EQ(edges.size(), 1u);
    EXPECT_EQ(edges.at(0).verdict, LoopVerdict::kAccepted);
    EXPECT_EQ(edges.at(0).dvl_yaw_rad, known_rad);
    return edges.at(0).T_from_to.Translation();
  };
  EXPECT_NEAR(x_y_of(learnt_rad).y(), 0.0, 0.1);
  EXPECT_LT(x_y_of(0.0).y(), -0.4);
}

TEST(Run, GoThroughTheSameChainByThePapersMethod) {
  LoopCloserParams params;
  params.method = RegistrationMethod::kGicp;
  const Submap target = At(0, 0.0, 0.0);
  const Submap source = Make(1, {10.0, 12.0, 0.0}, {10.7, 11.5, 0.0});
  LoopCloser closer(params);
  closer.Add(target);
  closer.Add(source);
  PreparedSubmaps prepared({});
  const auto edges =
      EdgesOf(source, closer.PairsFor(SubmapId{1}), Always(target), params, &prepared);
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].verdict, LoopVerdict::kAccepted) << ToString(edges[0].verdict);
  EXPECT_NEAR(edges[0].T_from_to.x, 10.0, 0.1);
  EXPECT_NEAR(edges[0].T_from_to.y, 12.0, 0.1);
}

TEST(Run, LeavesOutWhatCannotBeLoaded) {
  const LoopPair pair{SubmapId{0}, SubmapId{1}, {}, 0.0};
  PreparedSubmaps prepared({});
  const auto nothing = [](SubmapId) { return nullptr; };
  EXPECT_TRUE(EdgesOf(At(1, 0.0, 0.0), {pair}, nothing, {}, &prepared).empty());
}

TEST(Run, LoadsOnlyWhatIsNotPrepared) {
  const Submap target = At(0, 0.0, 0.0);
  const LoopPair pair{SubmapId{0}, SubmapId{1}, {}, 0.0};
  PreparedSubmaps prepared({});
  int loaded = 0;
  const auto load = [&](SubmapId) {
    ++loaded;
    return std::make_shared<const Submap>(target);
  };
  for (const int id : {1, 2}) {
    const auto edges = EdgesOf(At(id, 0.0, 0.0), {pair}, load, {}, &prepared);
    EXPECT_EQ(edges.size(), 1u);
    EXPECT_EQ(loaded, 1);
  }
}

// The thread of a pair changes nothing of it.
TEST(Run, GivesTheSameResultsOnSeveralThreads) {
  const Submap source = Make(9, {10.0, 12.0, 0.0}, {11.2, 11.1, 0.0});
  std::vector<LoopPair> pairs;
  for (int i = 0; i < 6; ++i) {
    LoopPair pair{SubmapId{i}, SubmapId{9}, {{11.0 + 0.1 * i, 11.0, 0.0}, {}}, 0.0};
    pair.prior.covariance = Eigen::Vector3d(1.0, 1.0, 1e-4).asDiagonal();
    pairs.push_back(pair);
  }
  const auto run = [&](const ForEach& for_each) {
    PreparedSubmaps prepared({});
    return seastitch::Run({std::make_shared<const Submap>(source), pairs},
                          {},
                          Always(At(0, 0.0, 0.0)),
                          &prepared,
                          for_each);
  };
  const RegistrationResultSet in_turn = run(ForEachInTurn), beside = run(ForEachBeside);
  ASSERT_EQ(in_turn.edges.size(), 6u);
  ASSERT_EQ(beside.edges.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(beside.edges[i].from, in_turn.edges[i].from);
    EXPECT_EQ(beside.edges[i].T_from_to.Vector(), in_turn.edges[i].T_from_to.Vector());
    EXPECT_EQ(beside.edges[i].information, in_turn.edges[i].information);
  }
  ASSERT_EQ(beside.statistics.size(), in_turn.statistics.size());
  for (std::size_t i = 0; i < in_turn.statistics.size(); ++i)
    EXPECT_EQ(ToNumbers(beside.statistics[i]), ToNumbers(in_turn.statistics[i]));
}

TEST(Run, AnExceptionCostsItsOwnPairAlone) {
  const Submap target = At(0, 0.0, 0.0);
  const LoadSubmap load = [&](SubmapId id) {
    if (id == SubmapId{7}) throw std::runtime_error("such as std::bad_alloc");
    return std::make_shared<const Submap>(target);
  };
  for (const RegistrationMethod method : {RegistrationMethod::kGrid, RegistrationMethod::kGicp}) {
    LoopCloserParams params;
    params.method = method;
    PreparedSubmaps prepared({});
    const std::vector<LoopPair> pairs{{SubmapId{7}, SubmapId{9}, {}, 0.0},
                                      {SubmapId{0}, SubmapId{9}, {}, 0.0}};
    const auto closed = std::make_shared<const Submap>(At(9, 0.0, 0.0));
    const RegistrationResultSet results = seastitch::Run({closed, pairs}, params, load, &prepared);
    EXPECT_EQ(results.failed, 1);
    ASSERT_EQ(results.edges.size(), 1u);
    EXPECT_EQ(results.edges[0].from, SubmapId{0});
    EXPECT_TRUE(results.surface.has_value());
    // Of a source that cannot be had, nothing.
    const RegistrationResultSet none =
        seastitch::Run({nullptr, {{SubmapId{0}, SubmapId{7}, {}, 0.0}}}, params, load, &prepared);
    EXPECT_EQ(none.failed, 1);
    EXPECT_TRUE(none.edges.empty());
  }
}

TEST(PreparedSubmaps, PrepareASubmapOnceAndKeepNoMoreThanTheyMay) {
  const Submap first = At(0, 0.0, 0.0);
  const Submap second = At(1, 10.0, 0.0);
  PreparedSubmaps both({});
  const auto prepared = both.Get(first);
  both.Get(second);
  EXPECT_EQ(both.Get(first), prepared);

  PreparedSubmaps none({}, 0);
  const std::weak_ptr<const RegistrationSubmap> kept = none.Get(first);
  EXPECT_TRUE(kept.expired());
  EXPECT_FALSE(none.Get(first)->empty());
  EXPECT_EQ(none.Find(first.id), nullptr);
  none.Get(Submap{});
  EXPECT_EQ(none.Find(Submap{}.id), nullptr) << "without points, but not for nothing";
}

}  // namespace
}  // namespace seastitch
