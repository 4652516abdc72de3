#pragma once

#include <memory>
#include <string>

#include "oaslam/service/map_store.h"

namespace oaslam {

// The store of a folder, which must be writable (OpenMapStore).
std::unique_ptr<MapStore> OpenMapFolder(const std::string& folder);

}  // namespace oaslam
