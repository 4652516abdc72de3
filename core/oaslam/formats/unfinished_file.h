#pragma once

#include <string>
#include <system_error>

#include "oaslam/formats/leftover.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

// A file that is written under another name beside its own and takes its own when it is complete,
// so that a full disk or a killed program leaves what was there.
class UnfinishedFile {
 public:
  // `extension`: of the other name.
  explicit UnfinishedFile(const std::string& path, const std::string& extension = ".tmp");
  // Removes what was not renamed.
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  // The other name: "map.ply.1234-1.tmp" by the numbers of the process and of the file in it.
  const std::string& name() const { return name_; }
  // Gives the file its own name. The error, if that failed.
  [[nodiscard]] std::error_code Rename() const;

 private:
  std::string path_, name_;
  Leftover leftover_;
};

// Whether a file may be replaced: devices, pipes and links stay what they are.
bool IsReplaceable(const std::string& path);

// Calls `write` with the path at which to write a file, which replaces the present one unless
// `write` throws. Devices, pipes and links are written directly. Throws InputError.
template <typename Write>
void ReplaceFile(const std::string& path, Write write) {
  if (!IsReplaceable(path)) return write(path);
  const UnfinishedFile file(path);
  write(file.name());
  if (const std::error_code error = file.Rename())
    throw BadInput("{}: cannot be written: {}", path, error.message());
}

}  // namespace oaslam
