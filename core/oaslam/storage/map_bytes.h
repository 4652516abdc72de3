#pragma once

#include <string>
#include <string_view>

#include "oaslam/storage/map_file.h"

namespace oaslam {

// The bytes of the file that SaveMap would write. The bytes are written to and read from a
// temporary file (in TMPDIR, else /tmp), in a folder that only this user can read. Throws
// InputError.
std::string BytesOf(const SavedMap& saved);

// The map of such bytes, as LoadMap reads it. In the messages of errors the file is called "map".
// Throws InputError.
SavedMap MapOfBytes(std::string_view bytes);

}  // namespace oaslam
