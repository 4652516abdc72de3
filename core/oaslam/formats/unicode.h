#pragma once

#include <string>

namespace oaslam {

// A name as most systems write it: letters with their marks in one character (Unicode's normal form
// C), as opposed to macOS, which lists an umlaut as a letter and a mark. What is no UTF-8 stays.
std::string Composed(const std::string& name);

// Returns `path` if the file exists. Else returns the only existing path that differs from `path`
// just in the Unicode normal form of its names; else, or where several do, `path` itself.
std::string FileInEitherForm(const std::string& path);

}  // namespace oaslam
