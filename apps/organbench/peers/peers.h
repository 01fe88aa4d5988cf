// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "measuring/measurement.h"
#include "measuring/scenes.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/volume/volume.h"
#include "organbake/warp/view.h"

namespace organbake {

// VTK's filters as one calls them, on the voxels where they lie: no largest component, no cap, no
// check, no copy into a mesh of ours unless asked for. Flying edges use as many threads as TBB may.
std::size_t vtk_flying_edges_faces(const Volume& ct, double level);
std::size_t vtk_marching_cubes_faces(const Volume& ct, double level);
TriangleMesh vtk_marching_cubes(const Volume& ct, double level);  // world mm

// What people use today, with the settings that serve each best; input and output in our mesh.
TriangleMesh vtk_quadric_decimation(const TriangleMesh& surface, std::size_t faces);
TriangleMesh meshoptimizer_simplify(const TriangleMesh& surface, std::size_t faces);

std::string embree_version();
struct EmbreeScene;

// Depth maps as one traces them with Embree alone: a static scene, one ray a texel in coherent
// packets of 16, tiles spread over TBB, the float depth as it comes.
class EmbreeDepth {
 public:
  explicit EmbreeDepth(const TriangleMesh& mesh);
  ~EmbreeDepth();

  // Planar z by camera, row-major, +inf where there is nothing. Cameras must be free of distortion.
  void trace(const std::vector<PosedCamera>& cameras,
             std::vector<std::vector<float>>& depths_mm) const;

 private:
  std::unique_ptr<EmbreeScene> scene_;
};

struct EmbreeLens;

// A mesh that deforms, ray-traced as one does it with Embree: vertices rewritten, the tree
// refitted, one ray a pixel in packets of eight, rows spread over TBB, the vertices' colours
// interpolated.
class EmbreeFrames {
 public:
  // Throws BadDataError for a mesh without colours.
  explicit EmbreeFrames(const TriangleMesh& mesh);
  ~EmbreeFrames();

  // positions: one per vertex, mm.
  void draw(const std::vector<Eigen::Vector3d>& positions, const View& view, Rgb8Image& picture);

 private:
  void trace_row(const EmbreeLens& lens, int y, Rgb8Image& picture) const;

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
  // samples: of the outlines, a pixel; 1 or 4.
  SoftwareGl(const SkinnedMesh& skinned, int width, int height, int samples = 1);
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

// A point of a COLMAP model's points3D.txt.
struct ModelPoint {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double error_px = 0;           // mean reprojection error
  std::size_t sightings = 0;     // frames that see it
  double largest_angle_deg = 0;  // between two of them; 0 where the model has no tracks
};

// From a folder with cameras.txt (one lens), images.txt and points3D.txt. Where points have tracks,
// their errors are measured anew. Throws NoInputError, BadDataError.
std::vector<ModelPoint> read_model_points(const std::filesystem::path& model);

// How well a model's points are held: those of at least three frames and more than 2 degrees.
struct ModelQuality {
  std::size_t points = 0;
  double reprojection_px = 0;  // mean over their sightings
};
ModelQuality quality_of(const std::vector<ModelPoint>& points);

// Debian's colmap on frames that lie as PNG files in a folder, with masks (NAME.png.png, black =
// ignored) in another: features, sequential pairs, mapper, one SIMPLE_RADIAL lens for all, without
// a GPU.
struct ColmapRun {
  std::filesystem::path frames, masks, work;
  std::optional<Intrinsics> lens;  // given and kept; else found
  std::filesystem::path database() const { return work / "database.db"; }
};
struct ColmapResult {
  CameraSet cameras;
  std::vector<ModelPoint> points;
  Timing timing;  // of all three steps
};
bool has_colmap();
// Nothing when its mapper makes no model. Throws what run_worker does.
std::optional<ColmapResult> run_colmap(const ColmapRun& run, const RunContext& context);

}  // namespace organbake
