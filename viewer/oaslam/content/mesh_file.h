#pragma once

#include <string>

#include "oaslam/content/mesh.h"

namespace oaslam {

// Loads a model from a file of any format that assimp reads (glTF, OBJ, PLY...): all its meshes,
// placed by their nodes, in their rest pose. The colour of a vertex is its own times the material's
// base colour times the texture at the vertex: the texture is sampled at vertices only, so that a
// coarse mesh with a fine texture looks coarse. Throws InputError where the file is missing,
// unreadable, has no triangles or no extent, or more than two million triangles.
Mesh LoadMesh(const std::string& path);

}  // namespace oaslam
