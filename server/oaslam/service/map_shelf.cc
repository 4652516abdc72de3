#include "oaslam/service/map_shelf.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "oaslam/util/log.h"

namespace oaslam {

namespace {

constexpr size_t kMostNotices = 10'000;  // that wait: more than a store has maps

}  // namespace

MapShelf::MapShelf(std::shared_ptr<MapStore> store, const SlamConfig& config, size_t memory_bytes,
                   std::function<void(const std::string& map)> changed)
    : store_(std::move(store)),
      config_(config),
      memory_bytes_(memory_bytes),
      changed_(std::move(changed)),
      keeper_(1, kMostNotices) {
  store_->Watch([this](const std::string& map) { keeper_.TryAdd([this, map] { Notice(map); }); });
}

MapShelf::~MapShelf() { store_->EndWatch(); }

std::shared_ptr<MapShelf::Slot> MapShelf::SlotOf(const std::string& map) {
  const std::scoped_lock lock(mutex_);
  std::shared_ptr<Slot>& slot = slots_[map];
  if (!slot) slot = std::make_shared<Slot>();
  slot->used = ++uses_;
  return slot;
}

std::shared_ptr<const ServedMap> MapShelf::Get(const std::string& map) {
  CheckMapName(map);
  {
    const std::scoped_lock lock(mutex_);
    const auto found = slots_.find(map);
    if (found != slots_.end() && found->second->map) {
      found->second->used = ++uses_;
      Forget(*found->second);  // those that were in use when a map was loaded
      return found->second->map;
    }
  }
  const std::shared_ptr<Slot> slot = SlotOf(map);
  const std::scoped_lock loading(slot->loading);
  {
    const std::scoped_lock lock(mutex_);
    if (slot->map) return slot->map;  // another thread has loaded it meanwhile
  }
  return Load(map, *slot);
}

// The slot's `loading` is held.
std::shared_ptr<const ServedMap> MapShelf::Load(const std::string& map, Slot& slot) {
  const std::optional<MapFile> file = store_->Open(map);
  if (!file) {
    const std::scoped_lock lock(mutex_);
    slot.map = nullptr;
    slot.edits = nullptr;
    const auto found = slots_.find(map);  // names that clients make up take no memory
    if (found != slots_.end() && found->second.get() == &slot) slots_.erase(found);
    return nullptr;
  }
  std::shared_ptr<const ServedMap> loaded;
  try {
    loaded = std::make_shared<const ServedMap>(*file, config_);
  } catch (const InputError& error) {
    Log(LogLevel::kWarning, "map {}: {}", map, error.what());
    throw BrokenMap(fmt::format("map {}: its file is damaged", map));
  }
  if (loaded->bytes > memory_bytes_)
    throw BrokenMap(fmt::format("map {}: takes {} MB of memory, allowed by --memory: {}", map,
                                loaded->bytes >> 20, memory_bytes_ >> 20));
  const std::scoped_lock lock(mutex_);
  slot.map = loaded;
  Forget(slot);
  return loaded;
}

// Forgets maps until the others fit into the memory. A map in use stays: to forget it would free
// nothing, and the next request would load it a second time.
void MapShelf::Forget(const Slot& newest) {
  std::vector<Slot*> loaded;
  size_t sum = 0;
  for (const auto& [name, slot] : slots_)
    if (slot->map) {
      sum += slot->map->bytes;
      if (slot.get() != &newest) loaded.push_back(slot.get());
    }
  std::ranges::sort(loaded, {}, &Slot::used);
  for (Slot* slot : loaded) {
    if (sum <= memory_bytes_) return;
    if (slot->map.use_count() > 1) continue;
    sum -= slot->map->bytes;
    slot->map = nullptr;
  }
}

std::shared_ptr<const MapEdits> MapShelf::ReadEdits(const std::string& map, Slot& slot) {
  // All of them, since edits that were removed with their map have no entry.
  AnchorEdits stored = store_->AnchorsSince(map, 0);
  MapEdits edits{stored.version, stored.map_version, {}};
  for (AnchorEntry& entry : stored.entries) {
    const std::string name = entry.name;
    edits.anchors.emplace(name, std::move(entry));
  }
  auto now = std::make_shared<const MapEdits>(std::move(edits));
  const std::scoped_lock lock(mutex_);
  // Another thread may have read newer ones meanwhile.
  if (!slot.edits || slot.edits->version <= now->version) slot.edits = now;
  return slot.edits;
}

std::shared_ptr<const MapEdits> MapShelf::Edits(const std::string& map) {
  const std::shared_ptr<Slot> slot = SlotOf(map);
  {
    const std::scoped_lock lock(mutex_);
    if (slot->edits) return slot->edits;
  }
  return ReadEdits(map, *slot);
}

void MapShelf::Refresh(const std::string& map) {
  std::shared_ptr<Slot> slot;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = slots_.find(map);
    if (found == slots_.end()) return;  // nobody has asked for it
    slot = found->second;
  }
  const std::scoped_lock loading(slot->loading);
  std::shared_ptr<const ServedMap> map_now;
  {
    const std::scoped_lock lock(mutex_);
    map_now = slot->map;
  }
  if (map_now) {
    const std::optional<StoredMap> stored = store_->Find(map);
    if (!stored || stored->digest != map_now->stored.digest) Load(map, *slot);
    if (!stored) return;
  }
  ReadEdits(map, *slot);
}

void MapShelf::Notice(const std::string& map) {
  std::vector<std::string> names{map};
  if (map.empty()) {
    const std::scoped_lock lock(mutex_);
    names.clear();
    for (const auto& [name, slot] : slots_) names.push_back(name);
  }
  for (const std::string& name : names) {
    try {
      Refresh(name);
    } catch (const std::exception& error) {
      Log(LogLevel::kWarning, "map {}: {}; goes on as it was", name, error.what());
    }
    changed_(name);
  }
}

size_t MapShelf::loaded() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<size_t>(std::ranges::count_if(
      slots_, [](const auto& entry) { return entry.second->map != nullptr; }));
}

size_t MapShelf::bytes() const {
  const std::scoped_lock lock(mutex_);
  size_t sum = 0;
  for (const auto& [name, slot] : slots_)
    if (slot->map) sum += slot->map->bytes;
  return sum;
}

}  // namespace oaslam
