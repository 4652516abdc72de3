#include "oaslam/formats/time_unit.h"

#include "matchers.h"

namespace oaslam {
namespace {

using testing::DoubleEq;

std::vector<double> Film(double first, double step, int count = 30) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(first + step * i);
  return times;
}

TEST(TimeUnit, StepsOfSecondsAreAccepted) {
  for (const double step : {1e-4, 1.0 / 200, 1.0 / 30, 5.0})
    EXPECT_THAT(ProblemOfSteps(Film(0, step)), IsEmpty()) << step;
  EXPECT_THAT(ProblemOfSteps(Film(1403636579.7, 0.05)), IsEmpty());
  EXPECT_THAT(ProblemOfSteps(Film(1403636579, 60)), IsEmpty());  // a picture each minute, by date
  EXPECT_THAT(ProblemOfSteps(Film(0, 60, 5)), IsEmpty());
  EXPECT_THAT(ProblemOfSteps({7}), IsEmpty());
  EXPECT_THAT(ProblemOfSteps({7, 7, 7}), IsEmpty());
  EXPECT_THAT(ProblemOfSteps({0, 0.03, 0.06, 9e9}), IsEmpty());  // the median tells, not a gap
}

TEST(TimeUnit, OtherStepsAreNamedWithTheUnitThatTheyLookLike) {
  EXPECT_THAT(ProblemOfSteps(Film(1403636579763555584, 33333333)), HasSubstr("--time-unit ns"));
  EXPECT_THAT(ProblemOfSteps(Film(0, 5e7)), HasSubstr("--time-unit ns"));
  EXPECT_THAT(ProblemOfSteps(Film(1403636579763555, 33333)), HasSubstr("--time-unit us"));
  EXPECT_THAT(ProblemOfSteps(Film(0, 33333)), HasSubstr("--time-unit us"));
  EXPECT_THAT(ProblemOfSteps(Film(1403636579763, 33)), HasSubstr("--time-unit ms"));
  EXPECT_THAT(ProblemOfSteps(Film(0, 100.0 / 3)), HasSubstr("--time-unit ms, or s if it is s"));
  EXPECT_THAT(
      ProblemOfSteps(Film(0, 3.3e-8)),
      AllOf(HasSubstr("3.3e-08 s, allowed: 0.0001 to 3600"), Not(HasSubstr("--time-unit"))));
}

TEST(TimeUnit, NamesWithADecimalPointAreTimes) {
  const auto times =
      TimesOfNames({"d/1500000000.0.png", "d/1500000000.1.png", "d/1500000000.033333.png"});
  ASSERT_TRUE(times);
  EXPECT_THAT(times->seconds, ElementsAre(DoubleEq(1500000000), DoubleEq(1500000000.1),
                                          DoubleEq(1500000000.033333)));
  EXPECT_EQ(times->unit, 1);
  EXPECT_THAT(TimesOfNames({"9.5.jpg", "10.25.jpg", "11.jpg"})->seconds,
              ElementsAre(9.5, 10.25, 11));
  EXPECT_THAT(TimesOfNames({"1311868164.363181"})->seconds, ElementsAre(1311868164.363181));
}

TEST(TimeUnit, NamesThatAreDatesInOtherUnitsAreTimes) {
  const auto ns = TimesOfNames({"1403636579763555584.png", "1403636579813555456.png"});
  ASSERT_TRUE(ns);
  EXPECT_EQ(ns->unit, 1e-9);
  EXPECT_THAT(ns->seconds, ElementsAre(DoubleNear(1403636579.763555584, 1e-6),
                                       DoubleNear(1403636579.813555456, 1e-6)));
  EXPECT_EQ(TimesOfNames({"1403636579763.5.png"})->unit, 1e-3);
  EXPECT_EQ(TimesOfNames({"33.png", "66.png"}, 1e-3)->seconds.back(), 0.066);
}

TEST(TimeUnit, OtherNamesAreNoTimes) {
  EXPECT_FALSE(TimesOfNames({}));
  EXPECT_FALSE(TimesOfNames({"000001.png", "000002.png"}));
  EXPECT_FALSE(TimesOfNames({"1500000001.png", "1500000002.png"}));  // may count anything
  EXPECT_FALSE(TimesOfNames({"1.5.png", "b.png"}));
  EXPECT_FALSE(TimesOfNames({"1.1.png", "1.2.png", "1.10.png"}));  // numbered chapters
  EXPECT_FALSE(TimesOfNames({"1.2.3.png"}));
  EXPECT_FALSE(TimesOfNames({"-1.5.png"}));
  EXPECT_FALSE(TimesOfNames({"1e5.5.png"}));
}

}  // namespace
}  // namespace oaslam
