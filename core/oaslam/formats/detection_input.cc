#include "oaslam/formats/detection_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/unicode.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// The numbers from 1 to 90 that COCO does not use.
constexpr std::array kGaps91 = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83};
constexpr int kLast91 = 90, kLast80 = 79;

bool Is91(int category) {
  return category >= 1 && category <= kLast91 &&
         std::ranges::find(kGaps91, category) == kGaps91.end();
}

int From91(int category) {
  const auto gaps = std::ranges::count_if(kGaps91, [category](int gap) { return gap < category; });
  return category - 1 - static_cast<int>(gaps);
}

void Renumber(const std::function<int(int)>& number, std::vector<ImageDetections>& images) {
  for (ImageDetections& image : images)
    for (Detection& detection : image.detections) {
      detection.category_id = number(detection.category_id);
      for (Label& label : detection.other_labels) label.category_id = number(label.category_id);
    }
}

std::set<int> CategoriesIn(const std::vector<ImageDetections>& images) {
  std::set<int> categories;
  for (const ImageDetections& image : images)
    for (const Detection& detection : image.detections) {
      categories.insert(detection.category_id);
      for (const Label& label : detection.other_labels) categories.insert(label.category_id);
    }
  return categories;
}

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// The first or last number in a name, without zeros that do not count: "1.5" of "cam0_0001.50.png"
// (the last). Empty where there is none.
std::string NumberIn(const std::string& name, bool is_last) {
  const std::string stem = WithoutExtension(BaseName(name));
  const auto is_part = [&](size_t i) {
    return IsDigit(stem[i]) || (stem[i] == '.' && i > 0 && i + 1 < stem.size() &&
                                IsDigit(stem[i - 1]) && IsDigit(stem[i + 1]));
  };
  std::string number;
  for (size_t i = 0; i < stem.size() && (number.empty() || is_last);) {
    const size_t begin = i;
    while (i < stem.size() && is_part(i)) ++i;
    if (i > begin) number = stem.substr(begin, i - begin);
    if (i == begin) ++i;
  }
  if (number.find('.') != std::string::npos) {
    number.erase(number.find_last_not_of('0') + 1);
    if (number.ends_with('.')) number.pop_back();
  }
  // The last digit of zero stays.
  while (number.size() > 1 && number[0] == '0' && number[1] != '.') number.erase(0, 1);
  return number;
}

// Indices of names by the number in them; empty where one has none, or two have the same.
std::map<std::string, size_t> Numbered(const std::vector<std::string>& names) {
  for (const bool is_last : {true, false}) {
    std::map<std::string, size_t> numbered;
    for (size_t i = 0; i < names.size(); ++i)
      if (const std::string number = NumberIn(names[i], is_last); !number.empty())
        numbered.emplace(number, i);
    if (numbered.size() == names.size()) return numbered;
  }
  return {};
}

// A whole number that is larger by `offset`.
std::string Moved(const std::string& number, int offset) {
  const auto value = ParseNumber(number);
  constexpr double kMost = 1e15;  // exact
  return offset == 0 || !value || *value > kMost ? number : fmt::format("{:.15g}", *value + offset);
}

// Indices of images by indices of names.
using Matches = std::map<size_t, size_t>;

Matches MatchNumbers(const std::map<std::string, size_t>& names,
                     const std::map<std::string, size_t>& images, int offset) {
  Matches matches;
  for (const auto& [number, i] : names)
    if (const auto found = images.find(Moved(number, offset)); found != images.end())
      matches.emplace(i, found->second);
  return matches;
}

// By number as they are, unless only the numbers above or below all belong to images: then one side
// counts from 1.
Matches MatchByNumber(const std::vector<std::string>& names, const std::vector<std::string>& images,
                      bool only_moved) {
  const auto numbers = Numbered(names), image_numbers = Numbered(images);
  const Matches same = MatchNumbers(numbers, image_numbers, 0);
  if (same.size() < names.size())
    for (const int offset : {-1, 1})
      if (Matches moved = MatchNumbers(numbers, image_numbers, offset);
          !moved.empty() && moved.size() == names.size())
        return moved;
  return only_moved ? Matches() : same;
}

// Whether an image has detections by its name, with or without its extension. Throws where that is
// not unique.
bool IsMatched(const std::string& image, const std::map<std::string, int>& names,
               const std::map<std::string, int>& stems, const std::string& path) {
  if (names.contains(BaseName(image))) return true;
  const std::string stem = WithoutExtension(BaseName(image));
  const auto found = stems.find(stem);
  if (found == stems.end()) return false;
  if (found->second > 1)
    throw BadInput("{}: {} names are \"{}\" without their extension, as image \"{}\" is", path,
                   found->second, stem, BaseName(image));
  return true;
}

// A name as a file of detections has it: bytes that are not UTF-8 replaced, in one normal form.
std::string AsWritten(const std::string& name) {
  return Composed(nlohmann::json::parse(JsonText(nlohmann::json(name))).get<std::string>());
}

// Gives entries whose names are those of images but for how they are written the names of these.
DetectionTable InFormOf(const std::vector<std::string>& images, const DetectionTable& detections) {
  std::map<std::string, std::set<std::string>> spellings;  // of stems
  for (const std::string& image : images) {
    const std::string stem = WithoutExtension(BaseName(image));
    spellings[AsWritten(stem)].insert(stem);
  }
  std::vector<ImageDetections> renamed = detections.images();
  bool is_new = false;
  for (ImageDetections& image : renamed) {
    const std::string stem = WithoutExtension(BaseName(image.file_name));
    const auto found = spellings.find(AsWritten(stem));
    if (found == spellings.end() || found->second.size() > 1 || found->second.contains(stem))
      continue;
    image.file_name = *found->second.begin();
    is_new = true;
  }
  return is_new ? DetectionTable(std::move(renamed)) : detections;
}

// Adds an entry without detections for each image that has none, while an image of the same base
// name in another folder has one. Throws where the folders do not tell which entry is meant.
DetectionTable WithFolders(const std::vector<std::string>& images, const DetectionTable& detections,
                           const std::string& path) {
  std::map<std::string, std::vector<std::string>> paths, entries;  // by base name
  for (const std::string& image : images) paths[BaseName(image)].push_back(image);
  for (const ImageDetections& entry : detections.images())
    entries[BaseName(entry.file_name)].push_back(entry.file_name);
  std::vector<ImageDetections> added;
  for (const auto& [name, same] : paths) {
    const auto found = entries.find(name);
    if (found == entries.end() || (same.size() < 2 && found->second.size() < 2)) continue;
    const auto has_entry = [&](const std::string& image) {
      return std::ranges::any_of(
          found->second, [&](const std::string& entry) { return AreInSameFolder(entry, image); });
    };
    const bool has_bare = std::ranges::find(found->second, name) != found->second.end();
    if (has_bare || std::ranges::none_of(same, has_entry))
      throw BadInput(
          "{}: {} of {} images named {} is not clear, as of {}: names need the folder, as oaslam "
          "detect writes it",
          path, Quoted(found->second.front()), same.size(), Quoted(name), same.front());
    for (const std::string& image : same)
      if (!has_entry(image)) added.push_back({image, {}});
  }
  if (added.empty()) return detections;
  added.insert(added.begin(), detections.images().begin(), detections.images().end());
  return DetectionTable(std::move(added));
}

}  // namespace

bool AreInSameFolder(const std::string& one, const std::string& other) {
  const std::string a = one.substr(0, one.size() - BaseName(one).size());
  const std::string b = other.substr(0, other.size() - BaseName(other).size());
  const std::string& longer = a.size() > b.size() ? a : b;
  const std::string& shorter = a.size() > b.size() ? b : a;
  return longer == shorter || (!shorter.empty() && longer.ends_with("/" + shorter));
}

CocoNumbers NumbersOf(const std::vector<ImageDetections>& images) {
  const std::set<int> categories = CategoriesIn(images);
  if (categories.empty() || !std::ranges::all_of(categories, Is91)) return CocoNumbers::k80;
  return *categories.rbegin() > kLast80 ? CocoNumbers::k91 : CocoNumbers::kUnclear;
}

void Renumber91To80(std::vector<ImageDetections>& images) {
  Renumber([](int category) { return Is91(category) ? From91(category) : category; }, images);
}

bool RenumberByName(const ClassNames& names, const ClassNames& wanted,
                    std::vector<ImageDetections>& images) {
  std::map<int, int> number_of;
  for (const int category : CategoriesIn(images)) {
    const auto name = names.find(category);
    if (name == names.end()) return false;
    const auto same = std::ranges::find(wanted, name->second, &ClassNames::value_type::second);
    if (same == wanted.end()) return false;
    number_of[category] = same->first;
  }
  Renumber([&](int category) { return number_of.at(category); }, images);
  return true;
}

DetectionTable MatchedToImages(const DetectionTable& given, const std::vector<std::string>& images,
                               const std::string& path) {
  if (given.images().empty() || images.empty()) return given;
  const DetectionTable detections = WithFolders(images, InFormOf(images, given), path);
  std::vector<std::string> names;
  std::map<std::string, int> by_name, by_stem;
  for (const ImageDetections& image : detections.images()) {
    names.push_back(image.file_name);
    ++by_name[BaseName(image.file_name)];
    ++by_stem[WithoutExtension(BaseName(image.file_name))];
  }
  const auto matched = std::ranges::count_if(
      images, [&](const std::string& image) { return IsMatched(image, by_name, by_stem, path); });
  // Names that are those of images but for the last one are counted from 1.
  const Matches matches = MatchByNumber(names, images, matched > 0);
  if (matched > 0 && matches.empty()) return detections;
  if (matches.empty())
    throw BadInput(
        "{}: none of its {} names belongs to an image, by name or by number: it has {}, the "
        "images {}",
        path, names.size(), Quoted(names.front()), Quoted(BaseName(images.front())));
  std::vector<ImageDetections> result;
  for (const auto& [name, image] : matches)
    result.push_back({images[image], detections.images()[name].detections});
  const auto& [name, image] = *matches.begin();
  Log(LogLevel::kInfo, "{}: names are matched by number, {} of {}: {} is that of image {}", path,
      matches.size(), names.size(), Quoted(BaseName(names[name])), Quoted(BaseName(images[image])));
  return DetectionTable(std::move(result));
}

}  // namespace oaslam
