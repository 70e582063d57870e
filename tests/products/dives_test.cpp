#include "products/track/dives.hpp"

#include <gmock/gmock.h>

#include "tests/products/synthetic_survey.hpp"

namespace seastitch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::LoopEdge;

// Four dives of two submaps each.
Survey FourDives(const std::vector<GraphEdge>& closures) {
  Survey survey;
  survey.dives = {"A", "B", "C", "D"};
  for (int id = 0; id < 8; ++id) {
    SurveySubmap submap;
    submap.id.value = id;
    submap.chain = id / 2;
    survey.submaps.push_back(submap);
  }
  survey.edges = closures;
  for (const GraphEdge& e : closures) survey.solution.loop_edges.push_back({e.from, e.to, 1.0});
  return survey;
}

TEST(Dives, AreJoinedByTheClosuresThatTheGraphBelieves) {
  Survey survey =
      FourDives({LoopEdge(0, 1), LoopEdge(0, 2), LoopEdge(1, 3), LoopEdge(3, 4), LoopEdge(0, 6)});
  survey.solution.loop_edges.back().weight = 0.1;  // the last one is refused
  const std::vector<DiveInMap> dives = DivesInMap(survey);
  ASSERT_EQ(dives.size(), 4u);
  EXPECT_THAT(dives[0].closures, ElementsAre(std::pair(std::size_t{1}, 2)));
  EXPECT_THAT(dives[1].closures,
              ElementsAre(std::pair(std::size_t{0}, 2), std::pair(std::size_t{2}, 1)));
  EXPECT_EQ(dives[2].group, 0u);
  EXPECT_EQ(dives[3].group, 3u);
  const std::vector<std::string> sentences = SentencesOf(dives);
  EXPECT_EQ(sentences[1],
            "B (2 submaps) is joined to A by 2 loop closures and to C by 1 loop closure.");
  EXPECT_THAT(sentences[3], HasSubstr("D (2 submaps) stands apart"));
}

TEST(Dives, OneWithoutASubmapIsNamed) {
  Survey survey = FourDives({});
  survey.dives.push_back("E");
  EXPECT_THAT(SentencesOf(DivesInMap(survey))[4], HasSubstr("E (0 submaps) is not in the map."));
}

TEST(Dives, OneAloneIsNoneOfSeveral) {
  Survey survey;
  EXPECT_TRUE(DivesInMap(survey).empty());
  EXPECT_TRUE(SentencesOf(DivesInMap(survey)).empty());
}

}  // namespace
}  // namespace seastitch
