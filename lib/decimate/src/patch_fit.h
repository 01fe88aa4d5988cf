// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit_reference.h"
#include "fit_term.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

inline constexpr std::size_t kMostFree = 5;  // vertices of a patch that may move

// Where a proxy's point meets the surface.
struct SurfacePoint {
  Eigen::Vector3d point, normal;
};
using FaceTargets = std::vector<SurfacePoint>;  // of FitReference's points on one face

// A few faces of a proxy, by themselves: what is refitted after a local change.
struct ProxyPatch {
  std::vector<Eigen::Vector3d> vertices;  // the first `free` may move, the others hold the rim
  std::size_t free = 0;
  std::vector<Face> faces;             // of `vertices`
  std::vector<std::uint32_t> samples;  // of the reference, that belong to the patch
  // Of the first faces, when they are known already: asking the surface is what costs time.
  std::vector<const FaceTargets*> targets;
};

struct PatchFit {
  double energy = 0;                 // of all faces; infinity when the patch is no good
  std::vector<double> face_energy;   // both sides, one a face
  std::vector<double> facing;        // mean cosine to the surface's normals, one a face
  std::vector<std::uint32_t> owner;  // each sample's face
  std::vector<FaceTargets> targets;  // of all faces
};

struct PatchFitOptions {
  int steps = 3;
  FitNorm norm;
  double give_up = 0;        // stop early when this energy is clearly out of reach; 0 = never
  bool keep_volume = true;   // the patch's share of it becomes volume_mm3
  double volume_mm3 = 0;     // patch_volume() that is to be kept
  double least_quality = 0;  // no face of a worse shape, see face_quality()
  double least_facing = 0;   // no face looks farther away from the surface beneath it
};

// Measures the patch and moves its free vertices by Gauss–Newton steps; between the first and the
// last measure, the surface stands in by its tangent planes.
// A patch that ends with a face that is no good has infinite energy.
PatchFit fit_patch(ProxyPatch& patch, const FitReference& reference,
                   const PatchFitOptions& options);

// The same without moving anything.
PatchFit measure_patch(ProxyPatch& patch, const FitReference& reference, const FitNorm& norm);

// Volume between the patch and a fixed point; the same for any patch with the same rim up to the
// space between the two.
double patch_volume(const ProxyPatch& patch, const Eigen::Vector3d& from);

// 1 for an equilateral triangle, 0 for one without area: 4√3 · area / Σ edge².
double face_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace organbake
