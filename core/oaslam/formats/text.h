#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/util/trim.h"

namespace oaslam {

// Reads a whole text file and returns it as UTF-8 without a byte order mark. A file with the mark
// of UTF-16 is converted. Throws InputError when it cannot be read, or is larger than 1 GiB.
std::string ReadTextFile(const std::string& path);
// Writes to a temporary file beside `path` and renames it, so that a full disk or a killed process
// leaves the old file intact. What is no regular file, such as /dev/stdout, is written directly.
// Throws InputError when the content cannot be written completely.
void WriteTextFile(const std::string& path, const std::string& content);

// A finite decimal number and nothing else; independent of the locale.
std::optional<double> ParseNumber(std::string_view text);
// Fields separated by blanks or tabs.
std::vector<std::string_view> SplitFields(std::string_view line);
// Lines without their ends (LF or CRLF).
std::vector<std::string_view> SplitLines(std::string_view text);

// Whether the beginning of a file may be that of a text: UTF-16, or no control characters except
// tabs and line ends, and no line of more than 8192 bytes, twice the longest path.
bool LooksLikeText(std::string_view head);
// Puts a text on one line, without control characters. A text of more than `max_bytes` is cut
// between UTF-8 characters and ends in "...".
std::string OnOneLine(std::string text, size_t max_bytes);
// Text of a file for a message: in quotes, on one line, at most 60 bytes, which leaves room for
// path, key and bound in a line of a terminal.
std::string Quoted(std::string_view text);

std::string BaseName(const std::string& path);
// The extension with its dot, in lower case.
std::string LowerExtension(const std::string& path);
// A name without its extension; ".363181" of a time stamp is no extension, since an extension
// starts with a letter.
std::string WithoutExtension(const std::string& name);

// The number of edits (insert, delete, replace a character) between two words (Levenshtein 1966).
int EditDistance(std::string_view a, std::string_view b);
// The first of the words, of which there must be one, with the least EditDistance to `to`.
template <typename Words>
std::string NearestOf(const Words& words, std::string_view to) {
  return *std::ranges::min_element(words, {},
                                   [&](std::string_view word) { return EditDistance(word, to); });
}

}  // namespace oaslam
