// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "organbake/volume/region.h"
#include "organbake/volume/volume.h"

namespace organbake {

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
  bool of_this_scan = false;     // their file names its series
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

// The upright grid, in slices of spacing_mm, that a stack with gantry tilt or uneven gaps, sorted
// along its normal, is resampled to, without voxels. It grows by the shifts, so nothing is cut off.
// `first` is the grid of the stack's first plane.
Volume upright_grid(const PlaneStack& stack, const Volume& first, double spacing_mm,
                    const std::string& name);

// Planes [first, end) of a stack.
struct PlaneRange {
  int first = 0, end = 0;
  int count() const { return end - first; }
};
// Those that slices [k, k_end) of the upright grid lie between.
PlaneRange planes_needed(const PlaneStack& stack, double spacing_mm, int k, int k_end);

// Fills slices [k, k + count) of the upright grid's box `box` (k counted from the box's first) from
// the decoded planes `range` of the stack, by linear interpolation: in-plane shifts between pixels,
// and between the two neighbouring planes. What no plane covers becomes air.
void resample_planes(const PlaneStack& stack, double spacing_mm, const Volume& decoded,
                     const PlaneRange& range, const IndexBox& box, int k, int count, Volume& out);

}  // namespace organbake
