#pragma once

#include <string>

namespace oaslam {

// A name as most systems write it: letters with their marks in one character (Unicode's normal form
// C), as opposed to macOS, which lists an umlaut as a letter and a mark. What is no UTF-8 stays.
std::string Composed(const std::string& name);

// The file itself where it is there; else the one whose name, or that of a folder above it, is the
// same but for the normal form, if there is one alone; else the path as it is.
std::string FileInEitherForm(const std::string& path);

}  // namespace oaslam
