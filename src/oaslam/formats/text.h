#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// The whole file; throws InputError when it cannot be read.
std::string ReadTextFile(const std::string& path);
// Writes beside `path` (.tmp) and renames, so that a full disk or a kill leaves the old file whole;
// straight to what is no regular file, such as /dev/stdout. Throws InputError when it cannot be
// written whole.
void WriteTextFile(const std::string& path, const std::string& content);

// A finite decimal number and nothing else; independent of the locale.
std::optional<double> ParseNumber(std::string_view text);
std::string_view Trim(std::string_view text);
// Fields separated by blanks or tabs.
std::vector<std::string_view> SplitFields(std::string_view line);
// Lines without their ends (LF or CRLF).
std::vector<std::string_view> SplitLines(std::string_view text);

// Base name of a path.
std::string BaseName(const std::string& path);
// The extension with its dot, in small letters.
std::string LowerExtension(const std::string& path);
// A name without its extension; ".363181" of a time stamp is none, since an extension starts with a
// letter.
std::string WithoutExtension(const std::string& name);

// Edits (insert, delete, replace a character) that turn one word into the other (Levenshtein 1966).
int EditDistance(std::string_view a, std::string_view b);

}  // namespace oaslam
