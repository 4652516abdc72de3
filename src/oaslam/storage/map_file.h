#pragma once

#include <string>
#include <vector>

#include "oaslam/formats/class_names.h"
#include "oaslam/map/piece.h"

namespace oaslam {

// What a map file holds.
struct SavedMap {
  Map map;
  std::vector<FramePose> trajectory;
  ClassNames class_names;       // of the categories of its objects, at least
  std::vector<Piece> pieces{};  // that could not be joined with the map, largest first; no two, nor
                                // the map, share an id
};

// One SQLite file, written beside `path` and renamed, so that a crash leaves the old one whole
// (docs/formats.md has the schema). Equal maps give equal content: save(load(save(m))) is
// byte-equal. Of a map that breaks its invariants, which takes a defect of this library, what is
// concerned is left out, with a warning. Throws InputError.
void SaveMap(const std::string& path, const SavedMap& saved);

// Verifies application id, version, integrity, content checksum and the map's invariants. Throws
// InputError.
SavedMap LoadMap(const std::string& path);
// Makes one of the pieces the map, and the map a piece: 0 is the map itself, others are counted
// from 1 on. `path` is named where there is none.
void LeadWithPiece(const std::string& path, int piece, SavedMap& saved);
// One piece alone.
SavedMap LoadPiece(const std::string& path, int piece);

}  // namespace oaslam
