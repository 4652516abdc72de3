#include "oaslam/formats/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <system_error>

#include "oaslam/error.h"
#include "oaslam/util/leftover.h"
#include "oaslam/util/lower.h"
#include "oaslam/util/read_file.h"

namespace oaslam {
namespace {

// Detections of ten hours are smaller.
constexpr size_t kMaxTextFile = size_t{1} << 30;

}  // namespace

std::string ReadTextFile(const std::string& path) { return ReadFile(path, kMaxTextFile); }

void WriteTextFile(const std::string& path, const std::string& content) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_type type = fs::symlink_status(path, error).type();
  const bool is_plain = type == fs::file_type::regular || type == fs::file_type::not_found;
  // Devices, pipes and links are not replaced.
  const std::string written = is_plain ? path + ".tmp" : path;
  const Leftover leftover(is_plain ? written : "");
  errno = 0;
  std::ofstream file(written, std::ios::binary | std::ios::trunc);
  const bool is_open = file.is_open();
  file << content;
  file.close();
  bool success = static_cast<bool>(file);
  const int reason = errno;
  error = {success ? 0 : reason, std::generic_category()};
  if (is_plain && success) {
    fs::rename(written, path, error);
    success = !error;
  }
  if (success) return;
  const std::string why = error ? ": " + error.message() : "";
  if (is_plain && is_open) fs::remove(written, error);
  throw InputError(fmt::format("{}: cannot be written{}", path, why));
}

std::optional<double> ParseNumber(std::string_view text) {
  text = Trim(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::vector<std::string_view> SplitFields(std::string_view line) {
  std::vector<std::string_view> fields;
  for (size_t begin = line.find_first_not_of(" \t\r"); begin != std::string_view::npos;) {
    const size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(" \t\r", end);
  }
  return fields;
}

std::vector<std::string_view> SplitLines(std::string_view text) {
  std::vector<std::string_view> lines;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back(line);
    begin = end + 1;
  }
  return lines;
}

std::string BaseName(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

std::string LowerExtension(const std::string& path) {
  return Lower(std::filesystem::path(path).extension().string());
}

std::string WithoutExtension(const std::string& name) {
  const size_t dot = name.find_last_of('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 >= name.size()) return name;
  const char first = name[dot + 1];
  const bool is_extension = (first >= 'a' && first <= 'z') || (first >= 'A' && first <= 'Z');
  return is_extension ? name.substr(0, dot) : name;
}

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace oaslam
