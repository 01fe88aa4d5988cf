// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/capture/capture.h"
#include "organbake/core/random.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/registration/registered_surface.h"
#include "organbake/stereo/stereo_depth.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

Eigen::Vector3d random_direction(RandomStream& random);  // unit

// A pose that is off by exactly so much.
RigidTransform start_from(const RegisteredSurface& surface, const RigidTransform& truth,
                          double shift_mm, double turn_deg, std::uint64_t seed);

// What both eyes of an endoscope see of the phantom's laparoscopy at 40…100 mm.
struct EyePair {
  EyePair(int width, int height, std::uint64_t seed);

  LaparoscopyFrame left, right;
  Rectifier rectifier;

  // The depth of the left eye; where it shows tissue, when that is asked for.
  StereoDepth matched(Mask* tissue = nullptr) const;

 private:
  explicit EyePair(const LaparoscopyPhantom& phantom);
};

// A bundle as the stages make it, without a file: the surface in its vertices' colours. Throws what
// the stages throw. skin_edge_mm: of the smooth skin over the proxy; 0 = none.
Bundle memory_bundle(const TriangleMesh& surface, const TriangleMesh& proxy,
                     const PlacementOptions& placement, const CaptureOptions& capturing = {},
                     double skin_edge_mm = 6);

// An organ as engines hold it: some ten thousand faces under one texture.
struct SkinnedMesh {
  TriangleMesh mesh;                    // with the skin's colours at its vertices, linear
  std::vector<Eigen::Vector2f> texels;  // of each vertex, in pictures' widths; the skin repeats
  Rgb8Image skin;                       // sRGB
};

// Of a surface with colours that rays from its middle meet once: 20 · 4^subdivisions faces with
// their vertices on it, and its colours by longitude and latitude. Throws BadDataError where a ray
// meets nothing.
SkinnedMesh skinned_mesh(const TriangleMesh& surface, int subdivisions, int skin_px);

}  // namespace organbake
