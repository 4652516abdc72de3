#pragma once

#include <string>

namespace oaslam {

// A file that is not complete yet, or a folder that is still empty: what a sudden end of the
// program should not leave behind. The destructor forgets it, and removes nothing.
class Leftover {
 public:
  // An empty path: nothing.
  explicit Leftover(const std::string& path);
  ~Leftover();
  Leftover(const Leftover&) = delete;
  Leftover& operator=(const Leftover&) = delete;

 private:
  int place_ = -1;
};

// Removes the files, and the folders as far as they are empty. May be called by a signal handler,
// after which the program has to end.
void RemoveLeftovers() noexcept;

// A path in the folder of temporary files, of which mkstemp or mkdtemp makes a name. Throws
// InputError where there is no such folder.
std::string TemporaryPattern();

}  // namespace oaslam
