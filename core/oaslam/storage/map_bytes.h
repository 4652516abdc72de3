#pragma once

#include <string>
#include <string_view>

#include "oaslam/storage/map_file.h"

namespace oaslam {

// The bytes of the file that SaveMap would write. They pass through a file in the folder for
// temporary ones (TMPDIR, else /tmp), which only this user can read. Throws InputError.
std::string BytesOf(const SavedMap& saved);

// The map of such bytes, as LoadMap reads it. In the messages of errors the file is called "map".
// Throws InputError.
SavedMap MapOfBytes(std::string_view bytes);

}  // namespace oaslam
