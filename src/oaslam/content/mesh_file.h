#pragma once

#include <string>

#include "oaslam/content/mesh.h"

namespace oaslam {

// A model from a file of any format that assimp reads (glTF, OBJ, PLY...): all its meshes, placed
// by their nodes, in their pose at rest. Colours are those of the vertices times the material's
// base colour times its texture where the vertex lies: a texture is sampled once a vertex, so a
// coarse mesh with a fine texture looks coarse. Throws InputError: not there, not readable, without
// triangles or extent, or with more than two million triangles.
Mesh LoadMesh(const std::string& path);

}  // namespace oaslam
