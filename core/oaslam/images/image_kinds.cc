#include "oaslam/images/image_kinds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <ranges>
#include <set>
#include <utility>

#include "oaslam/formats/text.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// The words of a name in lower case, and its numbers: "depth" and "00012" of "depth_00012.png".
std::pair<std::vector<std::string>, std::string> WordsOf(const std::string& name) {
  std::vector<std::string> words;
  std::string numbers;
  char before = '\0';
  for (const char c : Lower(WithoutExtension(name))) {
    const bool is_digit = c >= '0' && c <= '9', is_letter = c >= 'a' && c <= 'z';
    const bool was_digit = before >= '0' && before <= '9',
               was_letter = before >= 'a' && before <= 'z';
    if (is_letter && !was_letter) words.emplace_back();
    if (is_letter) words.back() += c;
    if (is_digit && !was_digit) numbers += ' ';
    if (is_digit) numbers += c;
    before = c;
  }
  return {words, numbers};
}

// What an app or a tool measured or computed for an image, and saved under the number of it.
bool IsOfAnotherKind(const std::vector<std::string>& words) {
  static constexpr std::array kKinds = {"depth",    "conf",  "confidence", "disparity",
                                        "mask",     "masks", "normal",     "normals",
                                        "semantic", "seg",   "labels",     "instance"};
  return std::ranges::any_of(words, [](const std::string& word) {
    return std::ranges::find(kKinds, word) != kKinds.end();
  });
}

}  // namespace

void LeaveOutOtherKinds(const std::string& folder, bool quiet, std::vector<std::string>& names) {
  std::set<std::string> numbers;
  std::vector<std::string> candidates;  // the numbers of images of another kind, else empty
  for (const std::string& name : names) {
    const auto [words, number] = WordsOf(name);
    const bool is_other = IsOfAnotherKind(words) && !number.empty();
    if (!is_other) numbers.insert(number);
    candidates.push_back(is_other ? number : "");
  }
  std::vector<std::string> kept, left_out;
  for (size_t i = 0; i < names.size(); ++i)
    (candidates[i].empty() || !numbers.contains(candidates[i]) ? kept : left_out)
        .push_back(names[i]);
  if (!left_out.empty() && !quiet)
    Log(LogLevel::kWarning,
        "{}: {} images are left out, by their names depth, masks or the like of the other {}, such "
        "as {}",
        folder, left_out.size(), kept.size(), left_out.front());
  names = std::move(kept);
}

void WarnOfSeries(const std::string& folder, const std::vector<std::string>& names) {
  if (names.empty()) return;
  std::map<std::string, std::set<std::string>> series;  // numbers, by words
  for (const std::string& name : names) {
    const auto [words, number] = WordsOf(name);
    series[fmt::format("{}", fmt::join(words, "_"))].insert(number);
  }
  const std::set<std::string>& numbers = series.begin()->second;
  const auto is_same = [&](const auto& other) { return other.second == numbers; };
  if (series.size() > 1 && numbers.size() > 2 && std::ranges::all_of(series, is_same))
    Log(LogLevel::kWarning,
        "{}: has {} series of images with the same numbers ({}): two cameras? They are read one "
        "after the other; a list of paths gives one alone",
        folder, series.size(), fmt::join(std::views::keys(series), ", "));
}

}  // namespace oaslam
