#pragma once

#include <memory>
#include <string>

#include "oaslam/service/map_store.h"

namespace oaslam {

// The store of a PostgreSQL database, a postgresql:// URI (OpenMapStore).
std::unique_ptr<MapStore> OpenMapDatabase(const std::string& location);

}  // namespace oaslam
