#include "oaslam/formats/table_file.h"

#include <algorithm>

#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

std::vector<std::string_view> SplitCommas(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  for (size_t begin = 0; begin <= line.size();) {
    const size_t end = std::min(line.find(separator, begin), line.size());
    fields.push_back(Trim(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

double NumberAt(const std::vector<std::string_view>& fields, size_t column, const std::string& path,
                size_t line) {
  const auto value = column < fields.size() ? ParseNumber(fields[column]) : std::nullopt;
  if (!value) throw BadInput("{}:{}: column {}: expected a number", path, line, column + 1);
  return *value;
}

size_t ColumnOf(std::string_view header, std::initializer_list<std::string_view> names,
                const std::string& path) {
  const auto fields = SplitCommas(header);
  for (const std::string_view name : names)
    if (const auto found = std::ranges::find(fields, name); found != fields.end())
      return static_cast<size_t>(found - fields.begin());
  throw BadInput("{}:1: column \"{}\" is missing", path, *names.begin());
}

std::vector<std::vector<double>> LoadNumberRows(const std::string& path, size_t columns) {
  std::string text = ReadTextFile(path);
  std::ranges::replace(text, ',', ' ');
  std::vector<std::vector<double>> rows;
  size_t number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const auto fields = SplitFields(line);
    if (fields.empty() || fields[0].starts_with('#')) continue;
    std::vector<double>& row = rows.emplace_back();
    for (size_t i = 0; i < columns; ++i) row.push_back(NumberAt(fields, i, path, number));
  }
  return rows;
}

std::vector<std::vector<double>> LoadColumns(const std::string& path,
                                             const std::vector<std::string>& names) {
  const std::string text = ReadTextFile(path);
  const auto lines = SplitLines(text);
  if (lines.empty()) throw BadInput("{}: empty", path);
  std::vector<size_t> columns;
  for (const std::string& name : names) columns.push_back(ColumnOf(lines[0], {name}, path));
  std::vector<std::vector<double>> rows;
  for (size_t i = 1; i < lines.size(); ++i) {
    if (Trim(lines[i]).empty()) continue;
    const auto fields = SplitCommas(lines[i]);
    std::vector<double>& row = rows.emplace_back();
    for (const size_t column : columns) row.push_back(NumberAt(fields, column, path, i + 1));
  }
  return rows;
}

}  // namespace oaslam
