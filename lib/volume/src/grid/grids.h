// SPDX-License-Identifier: GPL-3.0-or-later
// The room of grids: from affines and from planes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"

namespace organbake {

// 0.06°: a shear that moves a voxel by 0.3 mm at 300 mm.
inline constexpr double kLargestShear = 1e-3;

// Sets spacing, direction and origin from the affine of a file: axes = columns, millimetres (LPS)
// per index. Throws BadDataError for axes that are not finite, vanish or are sheared by more than
// 0.06°; the rest of a shear (float32 text) is taken out by the nearest orthonormal matrix.
void set_grid(Volume& volume, const Eigen::Matrix3d& axes_mm, const Eigen::Vector3d& origin_mm,
              const std::string& name);

// Turns a RAS affine into an LPS one: the first two world axes change sign.
inline Eigen::Matrix3d lps_from_ras(const Eigen::Matrix3d& axes) {
  return Eigen::Vector3d(-1, -1, 1).asDiagonal() * axes;
}
inline Eigen::Vector3d lps_from_ras(const Eigen::Vector3d& point) {
  return {-point.x(), -point.y(), point.z()};
}

// Checks a header's sizes before memory is taken and returns the number of voxels: 1…65535 along
// each axis, at most 2³¹ in all. Throws BadDataError.
std::size_t checked_voxel_count(const std::array<std::int64_t, 3>& size, const std::string& name);
// The same, and gives the volume this size.
std::size_t set_size(Volume& volume, const std::array<std::int64_t, 3>& size,
                     const std::string& name);
// Of sizes that were calculated: whole numbers, as far as they are numbers at all.
std::size_t set_calculated_size(Volume& volume, const Eigen::Vector3d& size,
                                const std::string& name);

// A file's affine whose axes are too far from perpendicular for any rectangular grid to stand for
// it: axes_mm = columns, millimetres (LPS) per index.
struct ShearedAffine {
  Eigen::Matrix3d axes_mm = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  double degrees = 0;
};
using Shear = std::optional<ShearedAffine>;

// Sets the grid of a volume, whose size is known, from the affine of a file. Axes that are sheared
// by less than 0.06° (float32 text) are taken silently as the nearest perpendicular ones. Up to
// 0.5°, as converters' rounding leaves them, the nearest rectangular grid about the volume's centre
// is taken, and the warning says how far that moves a voxel. What is sheared by more comes back, to
// be straightened once the voxels are there. Throws BadDataError: axes that are not finite, vanish,
// or are sheared by more than 45°.
Shear set_grid_or_shear(Volume& volume, const Eigen::Matrix3d& axes_mm,
                        const Eigen::Vector3d& origin_mm, const std::string& name);

// The whole volume as stored, brought onto a rectangular grid where it is sheared: along the first
// axis as it was, the second turned in the plane of the first two, the third along their normal; so
// slices that were only pushed along each other stay slices. Values between voxels are linear, or
// the nearest voxel's for a mask; outside is background for a mask, else the lowest value (NaN in a
// volume of real numbers). Then cropped to the region asked for.
Volume straightened(Volume stored, const Shear& shear, const VolumeReadOptions& options,
                    const std::string& name);

// The eight corners of a box.
inline std::array<Eigen::Vector3d, 8> corners_of(const Eigen::Vector3d& low,
                                                 const Eigen::Vector3d& high) {
  std::array<Eigen::Vector3d, 8> all;
  for (int c = 0; c < 8; ++c)
    for (int axis = 0; axis < 3; ++axis) all[c][axis] = (c >> axis & 1) ? high[axis] : low[axis];
  return all;
}

// The part of a whole volume that options.region asks for, or all of it.
Volume within_region(Volume volume, const VolumeReadOptions& options, const std::string& name);

// Continuous index in one grid → continuous index in another, by way of the world.
class IndexMap {
 public:
  IndexMap(const Volume& target, const Volume& source) {
    offset_ = target.index_from_world(source.world_from_index(Eigen::Vector3d::Zero()));
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = Eigen::Vector3d::Unit(axis);
      linear_.col(axis) = target.index_from_world(source.world_from_index(step)) - offset_;
    }
  }
  Eigen::Vector3d operator()(const Eigen::Vector3d& index) const {
    return linear_ * index + offset_;
  }

 private:
  Eigen::Matrix3d linear_;
  Eigen::Vector3d offset_;
};

// The voxel whose cell holds a continuous index; nothing beyond the volume's cells.
inline std::optional<Eigen::Vector3i> nearest_voxel(const Volume& volume,
                                                    const Eigen::Vector3d& index) {
  Eigen::Vector3i voxel;
  for (int axis = 0; axis < 3; ++axis) {
    const double nearest = std::floor(index[axis] + 0.5);
    if (!(nearest >= 0 && nearest < volume.size[axis])) return std::nullopt;
    voxel[axis] = static_cast<int>(nearest);
  }
  return voxel;
}

// Parallel planes of pixels, each by its own corner: CT slices, or the frames of a segmentation.
// Where the corners run askew to the normal (a tilted gantry), or each frame is cropped for itself,
// drift_px says by how much.
struct PlaneStack {
  PlaneStack() = default;
  // axes: unit columns along the pixels' columns and rows, and the normal. pixel_mm: along the
  // first two. corners_mm: centre of each plane's first pixel, LPS, in any order.
  PlaneStack(const Eigen::Matrix3d& axes, const Eigen::Vector2d& pixel_mm,
             std::vector<Eigen::Vector3d> corners_mm);

  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector2d pixel_mm = Eigen::Vector2d::Ones();
  std::vector<Eigen::Vector3d> corners_mm;
  std::vector<double> along_mm;           // the normal, of each plane against the first
  std::vector<Eigen::Vector2d> drift_px;  // of each corner against the first (columns, rows)
};

// From where to where along the normal (mm, LPS · normal) a plane stands for what it shows.
struct Slab {
  double low_mm = 0, high_mm = 0;
  double thickness_mm() const { return high_mm - low_mm; }
};

// What tells how far planes lie apart that need not all be there.
struct GapClues {
  const Volume* scan = nullptr;  // that they may have been made on
  double told_mm = 0;            // from plane to plane; 0 = not told
  double thickness_mm = 0;       // of a plane; 0 = not told
  bool by_hand = false;          // one plane may be left out, and no gap is wrong
};

// The slabs of planes at increasing places along a normal. Where all lie on the scan's slices each
// takes its slice's share; else the gap is what most of the planes show, or is told. A file that
// tells another gap than its planes show, and a thickness that had to be assumed, go into the
// warnings. Throws BadDataError for gaps that nothing explains.
std::vector<Slab> slabs_of(const std::vector<double>& places_mm, const Eigen::Vector3d& normal,
                           const GapClues& clues, const std::string& name,
                           std::vector<std::string>& warnings);
// The gap that most of the planes show; 0 where they show none.
double shown_gap(const std::vector<double>& places_mm);

// Even slices along a normal, so thin that slabs begin and end between two of them.
struct EvenSlices {
  double first_mm = 0, spacing_mm = 1;  // the first one's middle
  int count = 1;
  // The first slice of a slab, and the one behind its last.
  std::pair<int, int> of(const Slab& slab) const;
};
// Throws BadDataError where slabs lie too unevenly.
EvenSlices slices_for(const std::vector<Slab>& slabs, const std::string& name);

// Planes as voxels of a rectangular grid: each is moved by whole voxels, so that it keeps its area,
// on a lattice on which their mean place is right.
struct PlacedPlanes {
  struct Place {
    int column = 0, row = 0;  // of the plane's first pixel
    int slice = 0, slice_end = 1;
  };
  Volume grid;                // without voxels
  std::vector<Place> places;  // of each plane
};
PlacedPlanes placed(const PlaneStack& stack, const std::vector<Slab>& slabs, int columns, int rows,
                    const std::string& name);

}  // namespace organbake
