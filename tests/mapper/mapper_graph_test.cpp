#include "tests/mapper/mapper_fixtures.hpp"

namespace seastitch {
namespace {

TEST(Mapper, NamesItsGraphByTheFirstStateAndEndsItOnce) {
  Embedding dive;
  dive.Drive(120.0);
  dive.Finish();
  dive.Finish();
  ASSERT_GE(dive.steps.size(), 2u);
  for (std::size_t i = 0; i < dive.steps.size(); ++i) {
    const GraphUpdate& update = dive.steps[i].update;
    EXPECT_EQ(update.version, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(update.graph_id, ToUtime(dive.navs.front().time));
    EXPECT_EQ(update.final, i + 1 == dive.steps.size());
  }
}

TEST(Mapper, EndsItsGraphWithAnEmptyVersionWhereNoSubmapIsOpen) {
  Embedding dive;
  dive.AddSubmap(ImportedSubmap(0, 0.0));
  dive.Finish();
  ASSERT_EQ(dive.steps.size(), 2u);
  EXPECT_FALSE(dive.steps[0].update.final);
  EXPECT_TRUE(dive.steps[1].update.final);
  EXPECT_TRUE(dive.steps[1].update.vertices.empty());
}

TEST(Mapper, RefusesASolutionOfAnotherGraph) {
  Embedding dive;
  dive.AddSubmap(ImportedSubmap(0, 0.0));
  PoseGraph solution;
  solution.graph_version = 1;
  solution.vertices = {{SubmapId{0}, {}, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}};
  solution.graph_id = dive.mapper.graph().graph_id() + 1;
  EXPECT_FALSE(dive.mapper.Take(solution));
  solution.graph_id = dive.mapper.graph().graph_id();
  EXPECT_TRUE(dive.mapper.Take(solution));
  EXPECT_EQ(dive.mapper.counters().at("pose_graph_refused"), 1);
}

TEST(Mapper, GoesOnWhereARegistrationEndsInAnException) {
  Embedding dive({}, 0);  // no cache of prepared submaps: every target is loaded
  dive.AddSubmap(ImportedSubmap(0, 0.0));
  const LoadSubmap good = dive.load;
  dive.load = [](SubmapId) -> std::shared_ptr<const Submap> { throw std::bad_alloc(); };
  dive.AddSubmap(ImportedSubmap(1, 2.0));
  EXPECT_EQ(dive.mapper.counters().at("registrations_failed"), 1);
  ASSERT_EQ(dive.mapper.conditions().size(), 1u);
  EXPECT_EQ(dive.mapper.conditions()[0].kind, &conditions::kRegistrationFailed);
  EXPECT_TRUE(dive.Edges(EdgeKind::kLoopClosure).empty());
  EXPECT_EQ(dive.Edges(EdgeKind::kDeadReckoning).size(), 1u);

  dive.load = good;
  dive.AddSubmap(ImportedSubmap(2, 4.0));
  EXPECT_EQ(dive.Edges(EdgeKind::kLoopClosure).size(), 2u);
  EXPECT_TRUE(dive.mapper.conditions().empty());
}

TEST(Mapper, HandsOutOneJobAtATimeInTheOrderOfTheSubmaps) {
  Mapper mapper{MapperParams{}};
  PreparedSubmaps prepared({});
  for (const int id : {0, 1, 2}) mapper.AddSubmap(ImportedSubmap(id, 60.0 * id));
  for (const int id : {0, 1, 2}) {
    const std::optional<RegistrationJob> job = mapper.NextJob();
    ASSERT_TRUE(job.has_value());
    EXPECT_EQ(job->closed->id.value, id);
    EXPECT_FALSE(mapper.NextJob().has_value());
    mapper.Take(seastitch::Run(
        *job, {}, [](SubmapId) { return nullptr; }, &prepared));
    EXPECT_EQ(mapper.graph().version(), id + 1);
  }
  EXPECT_FALSE(mapper.NextJob().has_value());
}

TEST(Mapper, AnImportedSubmapAfterADrivenOneHasNoKnownPlaceRelativeToIt) {
  Embedding dive;
  dive.Drive(40.0);
  Submap imported = ImportedSubmap(100, 0.0);
  dive.AddSubmap(imported);
  dive.Drive(60.0);
  dive.Finish();
  const Submap& next = *dive.submaps.at(SubmapId{101});
  EXPECT_FALSE(next.covariance_from_previous.has_value());
  EXPECT_TRUE(next.heading_sigma_rad.has_value());
}

TEST(Mapper, MakesNothingOfNothing) {
  Embedding dive;
  dive.Finish();
  EXPECT_TRUE(dive.steps.empty());
  EXPECT_TRUE(dive.mapper.IsWaiting());
}

}  // namespace
}  // namespace seastitch
