#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "oaslam/error.h"
#include "oaslam/service/map_store.h"
#include "oaslam/service/served_map.h"
#include "oaslam/service/worker_pool.h"

namespace oaslam {

// A map that is stored, but cannot be served. The message has its name, and no path.
class BrokenMap : public InputError {
 public:
  using InputError::InputError;
};

// The maps of a store that are in memory, loaded when they are first asked for. A map that is
// replaced in the store is loaded beside the old one, which is answered from until then. Where they
// take more memory than allowed, those that were asked for least lately are forgotten. Thread-safe.
class MapShelf {
 public:
  // `changed`: called with the name of a map after it or its edits have changed here, on a thread
  // of the shelf.
  MapShelf(std::shared_ptr<MapStore> store, const SlamConfig& config, size_t memory_bytes,
           std::function<void(const std::string& map)> changed);
  ~MapShelf();

  // Loads the map if it must, and then takes seconds. Null where there is no such map. Throws
  // BrokenMap where its file is damaged, or larger than the memory, and StoreUnavailable.
  std::shared_ptr<const ServedMap> Get(const std::string& map);
  // Reads what the store has now of this map; what it has not, is forgotten.
  void Refresh(const std::string& map);
  // The newest edits that are known; those of a map that was never asked for are read.
  std::shared_ptr<const MapEdits> Edits(const std::string& map);

  MapStore& store() { return *store_; }
  // Of all maps together.
  size_t memory_bytes() const { return memory_bytes_; }
  size_t loaded() const;
  size_t bytes() const;

 private:
  struct Slot {
    std::mutex loading;  // held while the map is loaded
    std::shared_ptr<const ServedMap> map;
    std::shared_ptr<const MapEdits> edits;
    uint64_t used = 0;  // when it was asked for last
  };

  std::shared_ptr<Slot> SlotOf(const std::string& map);
  std::shared_ptr<const ServedMap> Load(const std::string& map, Slot& slot);
  std::shared_ptr<const MapEdits> ReadEdits(const std::string& map, Slot& slot);
  void Notice(const std::string& map);
  void Forget(const Slot& newest);

  const std::shared_ptr<MapStore> store_;
  const SlamConfig config_;
  const size_t memory_bytes_;
  const std::function<void(const std::string& map)> changed_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Slot>> slots_;  // this, and map, edits and used of slots
  uint64_t uses_ = 0;                                   // are guarded by mutex_
  WorkerPool keeper_;  // last member: carries out what the store notices
};

}  // namespace oaslam
