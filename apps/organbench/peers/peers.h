// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "measuring/scenes.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/volume/volume.h"
#include "organbake/warp/view.h"

namespace organbake {

// VTK's filters as one calls them, on the voxels where they lie: no largest component, no cap, no
// check, no copy into a mesh of ours unless asked for. Flying edges use as many threads as TBB may.
std::size_t vtk_flying_edges_faces(const Volume& ct, double level);
TriangleMesh vtk_marching_cubes(const Volume& ct, double level);  // world mm

// What people use today, with the settings that serve each best; input and output in our mesh.
TriangleMesh vtk_quadric_decimation(const TriangleMesh& surface, std::size_t faces);
TriangleMesh meshoptimizer_simplify(const TriangleMesh& surface, std::size_t faces);

std::string embree_version();
struct EmbreeScene;

// A mesh with colours at its vertices, as one traces it with Embree alone: coherent packets of 16,
// rows of them spread over TBB. Cameras must be free of distortion.
class EmbreeTracer {
 public:
  explicit EmbreeTracer(const TriangleMesh& mesh);
  ~EmbreeTracer();

  // Planar z by camera, row-major, the float as it comes, +inf where there is nothing.
  void trace_depths(const std::vector<PosedCamera>& cameras,
                    std::vector<std::vector<float>>& depths_mm) const;
  // The mesh deformed, on black: vertices rewritten (one position each, mm), the tree refitted, the
  // colours interpolated.
  void draw(const std::vector<Eigen::Vector3d>& positions, const View& view, Rgb8Image& picture);

 private:
  std::unique_ptr<EmbreeScene> scene_;
  std::vector<std::array<std::array<std::uint8_t, 3>, 3>> colors_;  // of each face's corners, sRGB
};

// The image by OpenEXR alone, as ZIP at its own level, one thread.
void write_by_openexr(const std::filesystem::path& file, const ChannelImage& image);

// Mesa's llvmpipe through EGL without a display: the textured mesh drawn as a game engine draws it,
// its vertices uploaded anew each frame. It draws on the thread that calls.
class SoftwareGl {
 public:
  // Throws Error when no software renderer can be had; says why.
  SoftwareGl(const SkinnedMesh& skinned, int width, int height);
  ~SoftwareGl();

  // positions: one per vertex, mm. Returns when the picture is done.
  void draw(const std::vector<Eigen::Vector3d>& positions, const View& view);
  std::string renderer() const;  // as the driver names itself
  // The last one, on black.
  Rgb8Image picture() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
