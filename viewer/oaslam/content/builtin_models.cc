#include "oaslam/content/builtin_models.h"

#include <cmath>
#include <tuple>

#include "oaslam/content/mesh_builder.h"

namespace oaslam {
namespace {

using Vector = Eigen::Vector3f;

// A flag as on a golf course. The disc of grass is as wide as the cloth, so that the pole stands in
// the centre.
Mesh Flag() {
  MeshBuilder builder;
  constexpr float kRadius = 0.36F;
  builder.AddCone({0, 0, 0}, 0.035F, kRadius, 0.93F * kRadius, 24, LinearRgb(0x6aa84f));
  builder.AddCone({0, 0.035F, 0}, 0.012F, 0.055F, 0.05F, 16, LinearRgb(0x3b3f46));
  builder.AddCone({0, 0.035F, 0}, 0.935F, 0.016F, 0.014F, 10, LinearRgb(0xe3e8ee));
  builder.AddEllipsoid({0, 0.975F, 0}, {0.027F, 0.027F, 0.027F}, 12, LinearRgb(0xf2b632));
  constexpr int kColumns = 17, kBands = 3;
  const std::vector<Vector> bands = {LinearRgb(0xd1343f), LinearRgb(0xf6f4ee), LinearRgb(0xd1343f)};
  std::vector<std::vector<Vector>> cloth(kBands + 1);
  for (int i = 0; i <= kBands; ++i)
    for (int j = 0; j < kColumns; ++j) {
      const float s = static_cast<float>(j) / (kColumns - 1), t = static_cast<float>(i) / kBands;
      const float wave = s * std::sin(8 * s - 1.1F * t);
      cloth[i].emplace_back(0.015F + (kRadius - 0.015F) * s, 0.935F - 0.27F * t - 0.02F * s * s,
                            0.04F * wave);
    }
  builder.AddSheet(cloth, bands);
  return std::move(builder).Finish();
}

Mesh Arrow() {
  MeshBuilder builder;
  builder.AddCone({0, 0, 0}, 0.42F, 0, 0.27F, 24, LinearRgb(0xf39c12));
  builder.AddCone({0, 0.42F, 0}, 0.46F, 0.115F, 0.115F, 24, LinearRgb(0xf5b041));
  builder.AddCone({0, 0.88F, 0}, 0.12F, 0.115F, 0.115F, 24, LinearRgb(0xfdf2e0));
  return std::move(builder).Finish();
}

// A wooden crate: panels with a frame of beams around each.
Mesh Crate() {
  MeshBuilder builder;
  const Vector panel = LinearRgb(0xc08a4e), beam = LinearRgb(0x8a5a2b), iron = LinearRgb(0x4a4f57);
  constexpr float kHalf = 0.5F, kBeam = 0.11F, kIn = 0.04F;
  builder.AddBox({-kHalf + kIn, kIn, -kHalf + kIn}, {kHalf - kIn, 1 - kIn, kHalf - kIn}, panel);
  const auto ends = [&](bool high, float width) {
    return high ? std::pair(kHalf - width, kHalf) : std::pair(-kHalf, -kHalf + width);
  };
  const Vector up(0, kHalf, 0);
  for (int axis = 0; axis < 3; ++axis)
    for (const bool a : {false, true})
      for (const bool b : {false, true}) {
        // Beams along one axis end at those along the others, so that no faces coincide.
        Vector min, max;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const float inset = axis == 1 ? 0 : kBeam;
        std::tie(min[u], max[u]) = ends(a, kBeam);
        std::tie(min[v], max[v]) = ends(b, kBeam);
        min[axis] = -kHalf + inset;
        max[axis] = kHalf - inset;
        builder.AddBox(min + up, max + up, beam);
      }
  // Gaps between boards all around, and a plate on the front.
  constexpr float kGap = 0.006F, kAround = kHalf - kIn + 0.002F;
  for (const float y : {0.305F, 0.5F, 0.695F})
    builder.AddBox({-kAround, y - kGap, -kAround}, {kAround, y + kGap, kAround}, beam);
  builder.AddBox({-0.12F, 0.40F, kHalf - kIn / 2}, {0.12F, 0.60F, kHalf}, iron);
  return std::move(builder).Finish();
}

Mesh Tree() {
  MeshBuilder builder;
  builder.AddCone({0, 0, 0}, 0.28F, 0.075F, 0.05F, 10, LinearRgb(0x7a4f2a));
  builder.AddCone({0, 0.20F, 0}, 0.36F, 0.34F, 0.10F, 12, LinearRgb(0x2f6b3a));
  builder.AddCone({0, 0.44F, 0}, 0.32F, 0.265F, 0.07F, 12, LinearRgb(0x3b8246));
  builder.AddCone({0, 0.66F, 0}, 0.34F, 0.19F, 0, 12, LinearRgb(0x55a05a));
  return std::move(builder).Finish();
}

Mesh Robot() {
  MeshBuilder builder;
  const Vector shell = LinearRgb(0x4a90c2), light = LinearRgb(0xeef3f7), dark = LinearRgb(0x2b3440),
               glow = LinearRgb(0x7cf0d8), warm = LinearRgb(0xf2a33a);
  for (const float side : {-1.0F, 1.0F}) {
    builder.AddBox({side * 0.11F - 0.06F, 0, -0.07F}, {side * 0.11F + 0.06F, 0.06F, 0.13F},
                   dark);                                                        // foot
    builder.AddCone({side * 0.11F, 0.06F, 0}, 0.16F, 0.035F, 0.035F, 10, dark);  // leg
    builder.AddEllipsoid({side * 0.265F, 0.50F, 0}, {0.055F, 0.055F, 0.055F}, 12,
                         dark);                                                    // shoulder
    builder.AddCone({side * 0.285F, 0.29F, 0}, 0.19F, 0.033F, 0.038F, 10, shell);  // arm
    builder.AddEllipsoid({side * 0.285F, 0.27F, 0.01F}, {0.048F, 0.048F, 0.048F}, 12,
                         light);  // hand
    builder.AddEllipsoid({side * 0.085F, 0.765F, 0.165F}, {0.036F, 0.042F, 0.022F}, 12,
                         glow);                                                    // eye
    builder.AddCone({side * 0.235F, 0.715F, 0}, 0.09F, 0.028F, 0.028F, 10, warm);  // ear
  }
  builder.AddBox({-0.21F, 0.21F, -0.13F}, {0.21F, 0.57F, 0.13F}, shell);   // body
  builder.AddBox({-0.13F, 0.27F, -0.187F}, {0.13F, 0.53F, -0.13F}, dark);  // pack on the back
  builder.AddBox({-0.13F, 0.32F, 0.13F}, {0.13F, 0.50F, 0.145F}, light);   // plate on the chest
  builder.AddEllipsoid({0.07F, 0.44F, 0.145F}, {0.03F, 0.03F, 0.015F}, 12, warm);
  builder.AddBox({-0.09F, 0.36F, 0.145F}, {0.02F, 0.385F, 0.152F}, dark);
  builder.AddCone({0, 0.57F, 0}, 0.05F, 0.06F, 0.06F, 12, dark);           // neck
  builder.AddBox({-0.22F, 0.62F, -0.15F}, {0.22F, 0.89F, 0.15F}, light);   // head
  builder.AddBox({-0.18F, 0.665F, 0.15F}, {0.18F, 0.85F, 0.165F}, dark);   // face
  builder.AddBox({-0.06F, 0.69F, 0.165F}, {0.06F, 0.705F, 0.172F}, glow);  // mouth
  builder.AddCone({0, 0.89F, 0}, 0.07F, 0.011F, 0.011F, 8, dark);          // antenna
  builder.AddEllipsoid({0, 0.972F, 0}, {0.028F, 0.028F, 0.028F}, 12, warm);
  return std::move(builder).Finish();
}

}  // namespace

const std::vector<std::pair<std::string, Mesh>>& BuiltinModels() {
  static const std::vector<std::pair<std::string, Mesh>> models = {{"flag", Flag()},
                                                                   {"arrow", Arrow()},
                                                                   {"cube", Crate()},
                                                                   {"tree", Tree()},
                                                                   {"robot", Robot()}};
  return models;
}

}  // namespace oaslam
