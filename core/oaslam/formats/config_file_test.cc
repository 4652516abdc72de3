#include "oaslam/config_file.h"

#include "expect_input_error.h"
#include "folder_test.h"

namespace oaslam {
namespace {

struct ConfigFile : FolderTest {};

TEST_F(ConfigFile, SetsWhatItNamesAndKeepsTheRest) {
  SlamConfig config = SlamConfig::Offline();
  config.runner.seed = 7;
  LoadConfig(
      folder.Write(
          "c.yaml",
          "tracking:\n  min_inliers: 20\nobjects:\n  model: paper\n  min_score: 0.25\nbundle:\n"
          "features.descriptor: orb\n"),
      config);
  EXPECT_EQ(config.tracking.min_inliers, 20);
  EXPECT_EQ(config.objects.model, ObjectMethod::kPaper);
  EXPECT_EQ(config.objects.min_score, 0.25);
  EXPECT_EQ(config.features.descriptor, DescriptorKind::kOrb);
  EXPECT_EQ(config.runner.seed, 7);
  ApplySetting("features.descriptor=learned+orb", config);
  EXPECT_EQ(config.features.descriptor, DescriptorKind::kLearnedAndOrb);
}

TEST_F(ConfigFile, AKeyMayNameItsSection) {
  SlamConfig config = SlamConfig::Offline();
  LoadConfig(folder.Write("c.yaml", "tracking.min_inliers: 20\n"), config);
  EXPECT_EQ(config.tracking.min_inliers, 20);
}

TEST_F(ConfigFile, CommentsAloneSetNothing) {
  SlamConfig config = SlamConfig::Offline();
  LoadConfig(folder.Write("c.yaml", "# tracking:\n#   min_inliers: 20\n"), config);
  EXPECT_EQ(ConfigToYaml(config), ConfigToYaml(SlamConfig::Offline()));
}

TEST_F(ConfigFile, AllProblemsAtOnceAndNothingSet) {
  SlamConfig config = SlamConfig::Offline();
  const std::string error = InputErrorOf([&] {
    LoadConfig(folder.Write("c.yaml",
                            "features:\n  count: 1500\n  resolution: 3.5\ntracking:\n  min_inlier: "
                            "20\n  max_object_sigma: many\n"
                            "runner:\n  mode: fast\n  lag: 0\n"),
               config);
  });
  EXPECT_THAT(
      error,
      HasSubstrs("c.yaml:3: features.resolution: 3.5, expected a whole number",
                 "c.yaml:5: tracking.min_inlier: unknown key, the nearest is tracking.min_inliers",
                 "c.yaml:6: tracking.max_object_sigma: \"many\", expected a number",
                 "runner.mode: \"fast\", allowed: sequential | lockstep | live",
                 "runner.lag: 0, allowed: 1 to 1000"));
  EXPECT_EQ(config.features.count, SlamConfig::Offline().features.count);
}

TEST_F(ConfigFile, SettingIsAsStrictAsTheFile) {
  SlamConfig config = SlamConfig::Offline();
  ApplySetting("runner.mode=sequential", config);
  ApplySetting("objects.min_score = 0.4", config);
  EXPECT_EQ(config.runner.mode, RunnerMode::kSequential);
  EXPECT_EQ(config.objects.min_score, 0.4);
  EXPECT_INPUT_ERROR(
      ApplySetting("objects.minscore=0.4", config),
      AllOf(StartsWith("objects.minscore: "), HasSubstr("nearest is objects.min_score")));
  EXPECT_INPUT_ERROR(ApplySetting("objects.min_score=nan", config), HasSubstr("expected a number"));
  EXPECT_INPUT_ERROR(ApplySetting("objects.min_score=1.5", config), HasSubstr("allowed: 0 to 1"));
  EXPECT_INPUT_ERROR(ApplySetting("objects.min_score", config),
                     StartsWith("objects.min_score: expected section.key=value"));
}

TEST_F(ConfigFile, RoundTrip) {
  SlamConfig config = SlamConfig::Offline();
  config.relocalization.min_score = 0.1 + 1e-13;
  config.runner.mode = RunnerMode::kLive;
  SlamConfig copy = SlamConfig::Offline();
  LoadConfig(folder.Write("c.yaml", ConfigToYaml(config)), copy);
  EXPECT_EQ(copy.relocalization.min_score, config.relocalization.min_score);
  EXPECT_EQ(ConfigToYaml(copy), ConfigToYaml(config));
}

}  // namespace
}  // namespace oaslam
