#include "oaslam/formats/text.h"

#include <fmt/format.h>
#include <utf8proc.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <system_error>

#include "oaslam/formats/unfinished_file.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"
#include "oaslam/util/printable.h"
#include "oaslam/util/read_file.h"

namespace oaslam {
namespace {

// Detections of ten hours are smaller.
constexpr size_t kMaxTextFile = size_t{1} << 30;

// UTF-16 without its mark; half a pair of surrogates is no character and is left out.
std::string FromUtf16(std::string_view bytes, bool is_big_endian) {
  std::string text;
  int32_t high = 0;  // the first unit of a pair; 0: none
  for (size_t i = 0; i + 1 < bytes.size(); i += 2) {
    const auto a = static_cast<unsigned char>(bytes[i]),
               b = static_cast<unsigned char>(bytes[i + 1]);
    int32_t unit = is_big_endian ? a << 8 | b : b << 8 | a;
    const bool is_high = unit >= 0xd800 && unit < 0xdc00, is_low = unit >= 0xdc00 && unit < 0xe000;
    if (is_low && high != 0) unit = 0x10000 + ((high - 0xd800) << 10) + (unit - 0xdc00);
    const bool is_character = !is_high && (!is_low || high != 0);
    high = is_high ? unit : 0;
    utf8proc_uint8_t utf8[4];
    if (is_character)
      text.append(reinterpret_cast<const char*>(utf8),
                  static_cast<size_t>(utf8proc_encode_char(unit, utf8)));
  }
  return text;
}

}  // namespace

std::string ReadTextFile(const std::string& path) {
  std::string text = ReadFile(path, kMaxTextFile);
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  const bool is_big_endian = text.starts_with("\xfe\xff");
  if (is_big_endian || text.starts_with("\xff\xfe"))
    return FromUtf16(std::string_view(text).substr(2), is_big_endian);
  return text;
}

void WriteTextFile(const std::string& path, const std::string& content) {
  ReplaceFile(path, [&](const std::string& written) {
    errno = 0;
    std::ofstream file(written, std::ios::binary | std::ios::trunc);
    file << content;
    file.close();
    if (file) return;
    const std::error_code error(errno, std::generic_category());
    throw BadInput("{}: cannot be written{}", path, error ? ": " + error.message() : "");
  });
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

bool LooksLikeText(std::string_view head) {
  constexpr size_t kLongest = 8192;  // twice the longest path
  if (head.starts_with("\xff\xfe") || head.starts_with("\xfe\xff")) return true;  // UTF-16
  size_t length = 0;
  for (const unsigned char c : head) {
    if ((c < 0x20 && c != '\n' && c != '\r' && c != '\t') || c == 0x7F) return false;
    length = c == '\n' || c == '\r' ? 0 : length + 1;
    if (length > kLongest) return false;
  }
  return true;
}

std::string OnOneLine(std::string text, size_t max_bytes) {
  constexpr std::string_view kCut = "...";
  if (text.size() > max_bytes) {
    const auto goes_on = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; };
    size_t end = max_bytes - kCut.size();
    while (end > 0 && goes_on(text[end])) --end;
    text.replace(end, std::string::npos, kCut);
  }
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return text;
}

std::string Quoted(std::string_view text) {
  constexpr size_t kMaxBytes = 60, kQuotes = 2;
  return fmt::format("\"{}\"", OnOneLine(Printable(text), kMaxBytes - kQuotes));
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
