#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// The seconds in a unit of time: "s", "ms", "us" or "ns"; nothing for another name.
std::optional<double> SecondsInUnit(std::string_view name);
// The name of the unit that is so many seconds long.
std::string_view NameOfUnit(double seconds);

// The unit, in seconds, in which `time` since 1970 is a date from 2001 to 2100; nothing where there
// is none.
std::optional<double> UnitOfDate(double time);

// The median of the non-zero steps between successive times; 0 where there is none.
double MedianStep(const std::vector<double>& times);

// The unit below seconds in which a step is one of images that show the same place, else seconds.
double UnitOfStep(double step);

// The problem with image times in seconds, judged by their median step, with the unit that they
// probably have; empty where there is none. A step of more than 5 s is accepted where the times are
// dates in seconds, or where there are fewer than 10.
std::string ProblemOfSteps(const std::vector<double>& times);

// Times of images, taken from their names.
struct NameTimes {
  std::vector<double> seconds;  // one for each name, not sorted
  double unit = 1;              // that of the names, in seconds
};

// The times that image names without their extensions state; nothing where the names are no times.
// Names are times if all of them are numbers and, besides, one has a decimal point, or all are
// dates in ms, us or ns, or `unit` (in seconds) is given.
std::optional<NameTimes> TimesOfNames(const std::vector<std::string>& names,
                                      std::optional<double> unit = {});

}  // namespace oaslam
