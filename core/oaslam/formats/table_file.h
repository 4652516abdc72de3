#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// The fields of a line, without surrounding blanks.
std::vector<std::string_view> SplitCommas(std::string_view line, char separator = ',');
// Throws InputError where there is no number. Columns count from 0, lines from 1.
double NumberAt(const std::vector<std::string_view>& fields, size_t column, const std::string& path,
                size_t line);
// The index in the header of the column that has the first of these names. Throws InputError where
// there is none of them.
size_t ColumnOf(std::string_view header, std::initializer_list<std::string_view> names,
                const std::string& path);

// The first numbers of each line, separated by blanks or commas; lines that begin with '#' are left
// out. Throws InputError where a line has fewer.
std::vector<std::vector<double>> LoadNumberRows(const std::string& path, size_t columns);

// The numbers in these columns of a comma-separated file, a row each. Throws InputError.
std::vector<std::vector<double>> LoadColumns(const std::string& path,
                                             const std::vector<std::string>& names);

}  // namespace oaslam
