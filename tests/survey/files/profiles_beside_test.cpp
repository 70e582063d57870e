// Sound speed profiles in files beside the lines, and by --profile.
#include "survey/plan/profiles_beside.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "survey/errors.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "tests/support/temporary_dir.hpp"
#include "tests/survey/files/read_all.hpp"
#include "tests/survey/files/small_kmall.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// kNoon, an hour later and two days later; the speed at the surface tells them apart.
constexpr char kAtNoon[] =
    "( SoundVelocity 1.0 0 202605021200 57.0 5.0 -1 0 0 OMS01050 P 0121 )\n0 1501\n50 1490\n";
constexpr char kTwoHoursAndTwoDaysLater[] =
    "[SVP_VERSION_2]\nx\nSection 2026-122 14:00:00 57:00:00 05:00:00\n0 1502\n50 1490\n"
    "Section 2026-124 12:00:00 57:00:00 05:00:00\n0 1503\n50 1490\n";

class ProfilesBeside : public testing::Test {
 protected:
  // A survey without a profile of its own, or with one.
  fs::path Line(bool with_profile = false) const {
    Kmall line;
    line.Installation();
    if (with_profile) line.Profile(0.0, 1499.0);
    for (int i = 0; i < 5; ++i) line.Motion(i).Position(i).Ping(i + 0.5);
    return dir.Write("line.kmall", line.bytes());
  }
  // Speeds at the surface of the profiles that a mapper gets, in their order.
  static std::vector<double> Surface(const SurveyPlan& plan) {
    std::vector<double> speeds;
    SurveyFiles survey(plan);
    ReadAll(&survey,
            [&](const SoundVelocityProfile& profile) { speeds.push_back(profile.speed_mps[0]); });
    return speeds;
  }
  const TemporaryDir dir;
};

TEST_F(ProfilesBeside, OfTheSameDayAreUsedAndNamed) {
  const fs::path line = Line();
  dir.Write("noon.asvp", kAtNoon);
  dir.Write("Later.SVP", kTwoHoursAndTwoDaysLater);
  const SurveyPlan plan = PlanSurvey({line});
  EXPECT_THAT(Surface(plan), ElementsAre(1501.0, 1502.0));
  EXPECT_EQ(plan.profiles[0].time, FromUtime(kNoon)) << "that of the cast";
  EXPECT_THAT(plan.Text(),
              HasSubstr("sound speed profiles: 2 casts of Later.SVP, noon.asvp, for "
                        "each ping the nearest in time\n"));
  EXPECT_THAT(plan.warnings, IsEmpty());
}

TEST_F(ProfilesBeside, AFilesOwnComesFirst) {
  const fs::path line = Line(true);
  dir.Write("noon.asvp", kAtNoon);
  const SurveyPlan plan = PlanSurvey({line});
  EXPECT_THAT(Surface(plan), ElementsAre(1499.0));
  EXPECT_THAT(plan.Text(), HasSubstr("those of the survey files; not used: noon.asvp\n"));
}

TEST_F(ProfilesBeside, TheUsersComesBeforeAll) {
  const fs::path line = Line(true);
  dir.Write("noon.asvp", kAtNoon);
  const fs::path columns = dir.Write("cast.txt", "depth speed\n0 1510\n50 1505\n");
  const SurveyPlan plan = PlanSurvey({line}, false, {columns});
  EXPECT_THAT(Surface(plan), ElementsAre(1510.0));
  EXPECT_THAT(plan.Text(),
              HasSubstr("sound speed profile: cast.txt, 1 cast, in place of any other"));
  const fs::path none = dir.Write("none.txt", "nothing\n");
  EXPECT_THAT([&] { PlanSurvey({line}, false, {none}); },
              testing::ThrowsMessage<DataError>(HasSubstr("none.txt: no row of depth and sound")));
}

TEST_F(ProfilesBeside, OneOfAnotherTimeOrDamagedIsAWarning) {
  const fs::path line = Line();
  dir.Write("a.asvp", "( SoundVelocity 1.0 0 202505021200 57 5 )\n0 1501\n50 1490\n");
  dir.Write("b.svp", "\x01\x02\x03");
  const SurveyPlan plan = PlanSurvey({line});
  EXPECT_THAT(Surface(plan), IsEmpty());
  ASSERT_EQ(plan.warnings.size(), 2u);
  EXPECT_EQ(plan.warnings[0].code, WarningCode::kProfileNotUsed);
  EXPECT_THAT(plan.warnings[0].text, HasSubstr("a.asvp: no cast within 24 h"));
  EXPECT_THAT(plan.warnings[1].text, HasSubstr("b.svp: no row of depth and sound speed"));
}

TEST_F(ProfilesBeside, OneThatIsNamedAmongTheInputsIsNoSurveyFile) {
  const fs::path line = Line();
  fs::create_directory(dir / "casts");
  const fs::path cast = dir.Write("casts/noon.asvp", kAtNoon);
  const std::vector<DiveInput> dives = DivesAmong({line, cast});
  ASSERT_EQ(dives.size(), 1u);
  EXPECT_THAT(dives[0].files, ElementsAre(line));
  EXPECT_THAT(Surface(PlanSurvey(dives[0].files, false, {{}, dives[0].profiles})),
              ElementsAre(1501.0));
  EXPECT_THROW(DivesAmong({cast}), UsageError);
  EXPECT_THROW(DivesAmong({dir.Write("dive.lcmlog", ""), cast}), UsageError);
}

TEST_F(ProfilesBeside, OneThatIsReadInPartIsAWarningWhoeverNamesIt) {
  const fs::path line = Line();
  const fs::path cast = dir.Write("cast.txt", "0 1510\n50 1505\nend\n");
  const SurveyPlan plan = PlanSurvey({line}, false, {cast});
  EXPECT_THAT(Surface(plan), ElementsAre(1510.0));
  ASSERT_EQ(plan.warnings.size(), 1u);
  EXPECT_EQ(plan.warnings[0].code, WarningCode::kProfileNotUsed);
  EXPECT_THAT(plan.warnings[0].text, HasSubstr("cast.txt: line 3: expected depth"));
}

TEST_F(ProfilesBeside, PlacedSoundingsUseNoneAndANamedOneIsAWarning) {
  SurveyPlan plan;
  const fs::path cast = dir.Write("noon.asvp", kAtNoon);
  ChooseProfiles({cast, {}}, false, &plan);
  ChooseProfiles({{}, {cast}}, false, &plan);
  EXPECT_THAT(plan.profiles, IsEmpty());
  ASSERT_EQ(plan.warnings.size(), 2u);
  EXPECT_EQ(plan.warnings[1].code, WarningCode::kProfileNotUsed);
}

}  // namespace
}  // namespace seastitch
