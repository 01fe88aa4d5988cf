// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Usual depths of a map: from what a scope works at to what it cannot reach.
inline constexpr double kNearestDepth_mm = 2, kFarthestDepth_mm = 2000;

// One depth map, and where it was taken.
struct DepthView {
  std::string name;       // to speak of it
  PosedCamera camera;     // of the depth map, which knows no distortion: that is left out
  Plane depth_mm;         // planar; not finite or not positive where there is nothing
  Plane confidence;       // 0…1; empty = 1 everywhere
  Rgb8Image color;        // of any size; empty = the view colours nothing
  Intrinsics color_lens;  // of the colour picture, with its distortion
  // How the colour picture's axes are turned against the depth map's (rectified eyes).
  Eigen::Matrix3d color_from_camera = Eigen::Matrix3d::Identity();
  bool relative = false;  // depth_mm is in a unit of this map alone
};

// A depth map as it is fused: its noise averaged over the surface it lies on.
struct SmoothView {
  PosedCamera camera;
  Plane depth_mm;                        // +inf where there is nothing
  std::vector<Eigen::Vector3f> normals;  // camera axes, towards the camera
  Plane weight;              // confidence × cos² of the angle of view; 0 where there is nothing
  double noise_mm = 0;       // of a pixel, as it came
  double resolution_px = 1;  // what the averaging leaves of detail

  // World point of a pixel that has depth.
  Eigen::Vector3d point_world_mm(int x, int y) const;
  Eigen::Vector3d normal_world(int x, int y) const;
};

// The same with all lengths of the map, or of where its camera stands, this many times as long.
void scale_depth(double factor, SmoothView& view);
void scale_place(double factor, SmoothView& view);

// Throws BadDataError that names the view: its size is not its camera's, it has no depth at all, or
// lengths that no scope has.
SmoothView smooth_view(const DepthView& view);

// The median of what the views show, of a sample of pixels; 0 of none.
double usual_depth_mm(std::span<const SmoothView> views);

// Depth, normal and weight where a world point is seen; weight 0 where nothing is.
struct SeenSurface {
  double point_z_mm = 0;  // of the point asked for
  double depth_mm = 0;
  Eigen::Vector3d normal_camera = Eigen::Vector3d::Zero();
  double weight = 0;
};
SeenSurface seen_at(const SmoothView& view, const Eigen::Vector3d& point_world_mm);

// Whether what is seen faces the way that a point of that normal does: not the organ's other side.
bool is_same_side(const SmoothView& view, const SeenSurface& seen,
                  const Eigen::Vector3d& normal_world);

// Which lengths of depth maps and poses belong together.
enum class DepthScale {
  automatic,  // one where the maps are relative, or agree far better by it; else as given
  given,      // depths and poses are in one unit
  one,        // one scale between the depths of all maps and the poses
  each        // one for each map
};

struct SolvedScale {
  double place_factor = 1;           // of the cameras' places, in the unit of the depths
  std::vector<double> depth_factor;  // of each map's depths; their geometric mean is 1
  // How far apart in depth the views have the same place, median, as a share of the depth: by this
  // scale, with the depths and poses as they were, and if the cameras did not move at all.
  double apart = 1, apart_as_given = 1, apart_unmoved = 1;
  // Whether the scope's motion tells: without it the views would lie clearly farther apart.
  bool told() const;
};

// How depths and poses were brought to one unit.
struct FusedScale {
  DepthScale how = DepthScale::one;  // one or each
  SolvedScale solved = {};
  bool relative = false;  // the depths had no unit
  // Relative depths were brought to the poses' unit; else these were brought to the depths', whose
  // median, where they are relative, is put at kAssumedDepth_mm.
  bool in_poses_unit = false;
};
inline constexpr double kAssumedDepth_mm = 60;  // where laparoscopes work

struct ScaledViews {
  std::vector<SmoothView> views;
  std::optional<FusedScale> scale;  // nothing: depths and poses are in one unit as they are
};

// The views smoothed (smooth_view), depths and places in one unit. Throws BadDataError where some
// maps are relative and others are not.
ScaledViews scaled_views(const std::vector<DepthView>& views, DepthScale scale);

struct RefinedPoses {
  int rounds = 0;
  double moved_mm = 0, turned_rad = 0;  // the camera that was farthest off
  double before_mm = 0, after_mm = 0;   // from view to view, along the normal, root mean square
};

// Moves the cameras so that each view's points lie on the surfaces that the others see (point to
// plane, all views at once, Gauss–Newton with a robust weight), within small motions: each is held
// where it was given, as firmly as poses that are good to 1 mm and a degree. Deterministic.
RefinedPoses refine_poses(std::vector<SmoothView>& views);

// How far the views' surfaces are apart as they are, along the normal, root mean square.
double views_apart_mm(std::vector<SmoothView> views);

// A box of voxels along the world's axes.
struct VoxelBox {
  Eigen::Vector3d first_mm = Eigen::Vector3d::Zero();  // centre of the first voxel
  double voxel_mm = 1;
  std::array<int, 3> size = {0, 0, 0};

  std::size_t voxels() const {
    return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]);
  }
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * size[1] + y) * size[0] + x;
  }
};

// How far each voxel lies in front of the surface, as all views have it on average, weighted by
// their confidence (Curless & Levoy 1996): −1…1 in units of the truncation, + outside.
struct DistanceVolume {
  VoxelBox box;
  double truncation_mm = 3;
  std::vector<float> distance;
  std::vector<float> weight;  // 0 = no view has seen the voxel
};

// Round all that the views see but for stray pixels. `voxel_mm` 0: as fine as the views' pixels,
// and so that no more than kMostVoxels are needed. Throws UsageError when the one asked for needs
// more.
inline constexpr std::size_t kMostVoxels = 40'000'000;
VoxelBox box_round(const std::vector<SmoothView>& views, double voxel_mm);

DistanceVolume fuse_distances(const std::vector<SmoothView>& views, const VoxelBox& box,
                              double truncation_mm, const RunContext& context);

// The surface at distance 0, faces towards the views. Open: none where a voxel around was not
// seen. Closed: what was not seen is inside, and the box's sides close what leaves it.
enum class Holes { open, closed };
TriangleMesh surface_of(const DistanceVolume& volume, Holes holes);

// The surface with no edge longer than `longest_mm`, bent smoothly between the coarse vertices, so
// that colours can be kept finer than voxels tell shape. Borders stay. Throws UsageError where that
// takes too many faces.
TriangleMesh finer_surface(const TriangleMesh& coarse, double longest_mm);

// An open surface without its fringe: what lies at a border and is seen with less than
// `least_support` of the usual weight goes, as far inwards as that reaches, and what is left of the
// border is rounded along itself. Holes inside are not made, nor closed.
TriangleMesh trimmed_surface(TriangleMesh mesh, const DistanceVolume& volume, double least_support);

// What lit the pictures, to be divided out of them.
enum class PictureLight {
  any,     // unknown: colours stay as they are
  camera,  // a lamp at the lens: brightness goes with the cosine over the distance squared
};

struct FusionOptions {
  double voxel_mm = 0;  // 0 = as fine as the depth maps' pixels
  double color_mm = 0;  // longest edge of the surface, for its colours; 0 = as voxels have it
  Holes holes = Holes::open;
  // Of the usual weight, what a border of an open surface must have: poorer fringes are cut off,
  // and the border is rounded. 0 = it stays as the voxels have it.
  double least_support = 0;
  PictureLight light = PictureLight::any;
  bool refine = false;  // the poses
  DepthScale scale = DepthScale::automatic;
  std::size_t largest = 1;  // pieces of largest area that are kept; 0 = all

  void check() const;  // throws UsageError
};

struct FusedSurface {
  TriangleMesh mesh;  // world mm, coloured when a view has a picture
  double voxel_mm = 0, truncation_mm = 0;
  double apart_mm = 0;       // from view to view, along the normal, root mean square
  double colored_share = 0;  // of the vertices, seen by a picture
  std::optional<RefinedPoses> refined;
  std::optional<FusedScale> scale;   // how depths and poses came to one unit
  std::vector<PosedCamera> cameras;  // as they were used
};

// One surface of several depth maps. Throws BadDataError for a map that is not its camera's, that
// overlaps no other or is of another scale, and when no surface is left.
FusedSurface fuse_views(const std::vector<DepthView>& views, const FusionOptions& options,
                        const RunContext& context = {});

// How a view agrees with all the others about the surface.
struct ViewOverlap {
  double share = 0;     // of its points, those that another view sees, too
  double scale = 1;     // median of its depths over theirs, along their rays
  double agreeing = 1;  // share of those that lie where another view has the surface
  double spread = 0;    // median deviation of ln of its depths over theirs
};
// Whether hardly any of its points is seen by another view.
bool sees_nothing_in_common(const ViewOverlap& overlap);
// Whether few of its points lie where the others have a surface, and the rest all nearer or
// farther.
bool is_of_another_scale(const ViewOverlap& overlap);
std::vector<ViewOverlap> measure_overlap(const std::vector<SmoothView>& views);

}  // namespace organbake
