#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// The seconds in a unit of time: "s", "ms", "us" or "ns"; nothing for another name.
std::optional<double> SecondsInUnit(std::string_view name);
// The name of that unit.
std::string_view NameOfUnit(double seconds);

// The seconds in the unit in which a number is a date from 2001 to 2100, counted from 1970.
std::optional<double> UnitOfDate(double time);

// The median of the steps from a time to the next that are not 0; 0 where there is none.
double MedianStep(const std::vector<double>& times);

// What is wrong with times of images in seconds, and the unit that they look like, by the median
// step from one to the next; empty where nothing is. A step of seconds is accepted where the times
// are dates, or few.
std::string ProblemOfSteps(const std::vector<double>& times);

// Times of images, taken from their names.
struct NameTimes {
  std::vector<double> seconds;  // one for each name, not sorted
  double unit = 1;              // that of the names, in seconds
};

// The times that names of images (extensions are not looked at) stand for; nothing where they are
// names or numbers of another kind. All are numbers, and they are times where one of them has a
// decimal point, where they are dates in ms, us or ns, or where their unit is given (in seconds).
std::optional<NameTimes> TimesOfNames(const std::vector<std::string>& names,
                                      std::optional<double> unit = {});

}  // namespace oaslam
