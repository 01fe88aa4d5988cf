// SPDX-License-Identifier: GPL-3.0-or-later
// Where a volume, a scan or a mask ends while the organ goes on, and domes that end it there. A
// mask that ends shows a flat face where an organ tapers. The dome's height follows the section's
// distance transform, so that it has the section's own outline, however concave that is.
#include "surface_steps.h"

#include <vtkImageData.h>
#include <vtkImageEuclideanDistance.h>
#include <vtkNew.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/core/union_find.h"

namespace organbake {
namespace {

// A paraboloid half as high as a hemisphere over a round section, and all domes together no more
// than this share of the organ: what no scan has shown must not weigh in an organ's volume. Of the
// same volume it is a third higher than an ellipsoid, and looks less like a cut.
constexpr double kDomeHeight = 0.5;
constexpr double kMostAdded = 0.05;

// One layer of voxels across an axis, seen from the side where the organ ends: across it run the
// axes u and v.
struct Layer {
  int axis, at;
  bool high;

  int u() const { return (axis + 1) % 3; }
  int v() const { return (axis + 2) % 3; }
  Layer beyond(double steps) const {
    return {axis, at + static_cast<int>(high ? steps : -steps), high};
  }
  Eigen::Vector3i voxel(int column, int row) const {
    Eigen::Vector3i index;
    index[axis] = at;
    index[u()] = column;
    index[v()] = row;
    return index;
  }
};

// The layer's outer face, without a pixel that is cut.
CutSide face_of(const Volume& grid, const Layer& layer) {
  CutSide side;
  side.axis = layer.axis;
  side.high = layer.high;
  side.columns = grid.size[layer.u()];
  side.rows = grid.size[layer.v()];
  side.pixel_mm = {grid.spacing_mm[layer.u()], grid.spacing_mm[layer.v()]};
  side.step_mm = grid.spacing_mm[layer.axis];
  side.axes.col(0) = grid.direction.col(layer.u());
  side.axes.col(1) = grid.direction.col(layer.v());
  side.axes.col(2) = (layer.high ? 1 : -1) * grid.direction.col(layer.axis);
  side.first_mm = grid.world_from_index(layer.voxel(0, 0).cast<double>()) +
                  0.5 * side.step_mm * side.axes.col(2);
  side.cut.assign(static_cast<std::size_t>(side.columns) * side.rows, 0);
  return side;
}

// Calls cut(column, row, world) for each pixel, a point on the face.
template <class Cut>
void mark(CutSide& side, const Cut& cut) {
  std::size_t pixel = 0, count = 0;
  for (int row = 0; row < side.rows; ++row) {
    for (int column = 0; column < side.columns; ++column, ++pixel) {
      const Eigen::Vector3d along(column * side.pixel_mm.x(), row * side.pixel_mm.y(), 0);
      count += side.cut[pixel] = cut(column, row, side.first_mm + side.axes * along);
    }
  }
  side.area_mm2 = static_cast<double>(count) * side.pixel_mm.prod();
}

double value_at(const Volume& volume, const Eigen::Vector3i& at) {
  return volume.at(at.x(), at.y(), at.z());
}

bool holds(const Volume& grid, const Eigen::Vector3d& world) {
  const Eigen::Vector3d index = grid.index_from_world(world);
  for (int axis = 0; axis < 3; ++axis)
    if (index[axis] < -0.5 || index[axis] > grid.size[axis] - 0.5) return false;
  return true;
}

// A label's voxels as places that may lie anywhere.
struct Label {
  const Volume& mask;
  int label;

  bool at(const Layer& layer, int column, int row) const {
    if (layer.at < 0 || layer.at >= mask.size[layer.axis]) return false;
    return value_at(mask, layer.voxel(column, row)) == label;
  }
  bool at(const Eigen::Vector3d& world) const {
    if (!holds(mask, world)) return false;
    const Eigen::Vector3d index = mask.index_from_world(world);
    Eigen::Vector3i voxel;
    for (int axis = 0; axis < 3; ++axis)
      voxel[axis] = std::clamp(static_cast<int>(std::lround(index[axis])), 0, mask.size[axis] - 1);
    return value_at(mask, voxel) == label;
  }
};

// Whether the label's outermost layer is a face that something cut. The section of what ends by
// itself falls to nothing: as a quadric's it is followed by none (three sections extrapolated), and
// less than three fifths of the section before reach it. Inside a mask, where bones end flat, too,
// a cut is a large face whose two last sections are nearly one. `stride`: layers from section to
// section, as a mask brought onto a finer grid repeats its own.
bool ends_flat(const Label& label, const LabelBox& box, const Layer& last, int stride) {
  constexpr double kLeastNext = 0.1, kLeastKept = 0.6, kLeastKeptInside = 0.75;
  constexpr double kLeastOfMean = 0.25;  // of the mean section
  constexpr double kLeastPixels = 20;    // fewer tell no shape
  const Layer before = last.beyond(-stride), first = last.beyond(-2 * stride);
  double here = 0, second = 0, third = 0, both = 0;
  for (int row = box.first[last.v()]; row < box.first[last.v()] + box.size[last.v()]; ++row) {
    for (int col = box.first[last.u()]; col < box.first[last.u()] + box.size[last.u()]; ++col) {
      const bool in_last = label.at(last, col, row), in_before = label.at(before, col, row);
      here += in_last;
      second += in_before;
      both += in_last && in_before;
      third += label.at(first, col, row);
    }
  }
  if (here < kLeastPixels || 3 * (here - second) + third < kLeastNext * here) return false;
  const int end = label.mask.size[last.axis] - 1;
  if (last.at == 0 || last.at == end) return both > kLeastKept * second;
  const double mean = static_cast<double>(box.label_voxels) / box.size[last.axis];
  return both > kLeastKeptInside * std::max(here, second) && here > kLeastOfMean * mean;
}

// Layers that a mask repeats, brought from a coarser grid onto this one.
int stride_along(int axis, const Volume& mask, const Eigen::Vector3d& stairs) {
  double coarse_mm = 0;
  for (int a = 0; a < 3; ++a)
    if (stairs[a] > 1) coarse_mm = std::max(coarse_mm, stairs[a] * mask.spacing_mm[a]);
  return std::max(1, static_cast<int>(std::ceil(coarse_mm / mask.spacing_mm[axis] - 1e-6)));
}

bool parallel(const Volume& a, const Volume& b) {
  constexpr double kSmall = 0.02;  // a voxel at the end of fifty
  const Eigen::Matrix3d turn = (a.direction.transpose() * b.direction).cwiseAbs();
  return (turn.array() < kSmall || turn.array() > 1 - kSmall).all();
}

// Where the ends of a scan cut a label whose own grid lies askew to it.
void add_ends_of_scan(const Label& label, const Volume& scan, std::vector<CutSide>& sides) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      CutSide side = face_of(scan, {axis, high ? scan.size[axis] - 1 : 0, high});
      // A voxel's own length along the normal; the nearest voxel to a point lies within half of it.
      const Eigen::Vector3d outward = side.axes.col(2);
      side.step_mm =
          (label.mask.direction.transpose() * outward).cwiseAbs().dot(label.mask.spacing_mm);
      const Eigen::Vector3d half = 0.5 * side.step_mm * outward;
      mark(side, [&](int, int, const Eigen::Vector3d& at) {
        return label.at(at - half) && !label.at(at + half);
      });
      if (side.area_mm2 > 0) sides.push_back(std::move(side));
    }
  }
}

// How far inside the section each of its pixels lies (mm), 0 outside.
std::vector<double> depth_in(const CutSide& side) {
  // A ring of pixels that are outside lies around.
  const int columns = side.columns + 2, rows = side.rows + 2;
  vtkNew<vtkImageData> image;
  image->SetDimensions(columns, rows, 1);
  image->SetSpacing(side.pixel_mm.x(), side.pixel_mm.y(), 1);
  image->AllocateScalars(VTK_DOUBLE, 1);
  auto* pixel = static_cast<double*>(image->GetScalarPointer());
  for (int row = -1; row + 1 < rows; ++row) {
    for (int column = -1; column + 1 < columns; ++column, ++pixel) {
      const bool ring = row < 0 || column < 0 || row == side.rows || column == side.columns;
      *pixel = ring ? 0 : side.cut[std::size_t(row) * side.columns + column];
    }
  }
  vtkNew<vtkImageEuclideanDistance> filter;
  filter->SetInputData(image);
  filter->SetDimensionality(2);
  filter->InitializeOn();
  filter->ConsiderAnisotropyOn();
  filter->SetMaximumDistance(VTK_INT_MAX);
  filter->Update();
  const auto* squared = static_cast<const double*>(filter->GetOutput()->GetScalarPointer());
  const double half_pixel = 0.5 * side.pixel_mm.minCoeff();
  std::vector<double> depth;
  for (int row = 1; row + 1 < rows; ++row) {
    for (int column = 1; column + 1 < columns; ++column) {
      const double distance = std::sqrt(squared[std::size_t(row) * columns + column]);
      depth.push_back(std::max(0.0, distance - half_pixel));
    }
  }
  return depth;
}

// How high the dome stands over each pixel (mm); every piece of the section has a dome of its own.
std::vector<double> dome_heights(const CutSide& side) {
  const std::vector<double> depth = depth_in(side);
  const auto columns = static_cast<std::uint32_t>(side.columns);
  UnionFind joined(depth.size());
  for (std::uint32_t i = 0; i < depth.size(); ++i) {
    if (depth[i] == 0) continue;
    if (i % columns != 0 && depth[i - 1] > 0) joined.join(i, i - 1);
    if (i >= columns && depth[i - columns] > 0) joined.join(i, i - columns);
  }
  const std::vector<std::uint32_t> piece = std::move(joined).roots();
  std::vector<double> radius(depth.size(), 0), heights(depth.size(), 0);
  for (std::size_t i = 0; i < depth.size(); ++i)
    radius[piece[i]] = std::max(radius[piece[i]], depth[i]);
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (depth[i] > 0) heights[i] = kDomeHeight * depth[i] * (2 - depth[i] / radius[piece[i]]);
  return heights;
}

double highest(const CutSide& side) {
  return *std::max_element(side.dome_mm.begin(), side.dome_mm.end());
}

struct OverFace {
  double above_mm, dome_mm;  // of the face, and the dome's height there
};

OverFace over(const CutSide& side, const Eigen::Vector3d& world) {
  const Eigen::Vector3d at = side.axes.transpose() * (world - side.first_mm);
  const auto column = std::lround(at.x() / side.pixel_mm.x());
  const auto row = std::lround(at.y() / side.pixel_mm.y());
  const bool there = column >= 0 && row >= 0 && column < side.columns && row < side.rows;
  return {at.z(), there ? side.dome_mm[std::size_t(row) * side.columns + column] : 0};
}

// A copy with `layers` more slices on one side; what they hold is set later.
Volume grown(const Volume& volume, const CutSide& side, int layers) {
  Volume out = volume;
  out.size[side.axis] += layers;
  Eigen::Vector3i shift = Eigen::Vector3i::Zero();
  if (!side.high) shift[side.axis] = layers;
  out.origin_mm = volume.world_from_index(-shift.cast<double>());
  const std::size_t count = std::size_t(out.size[0]) * out.size[1] * out.size[2];
  volume.is_real() ? out.reals.assign(count, 0) : out.voxels.assign(count, 0);
  for (int k = 0; k < volume.size[2]; ++k) {
    for (int j = 0; j < volume.size[1]; ++j) {
      const std::size_t row =
          (std::size_t(k + shift.z()) * out.size[1] + j + shift.y()) * out.size[0] + shift.x();
      for (int i = 0; i < volume.size[0]; ++i)
        set_value(out, row + std::size_t(i), volume.at(i, j, k));
    }
  }
  return out;
}

Volume with_dome(const Volume& volume, const CutSide& side,
                 const std::function<double(double)>& value) {
  const int layers = static_cast<int>(std::ceil(highest(side) / side.step_mm)) + 2;
  Volume out = grown(volume, side, layers);
  Layer layer{side.axis, side.high ? volume.size[side.axis] : layers - 1, side.high};
  for (int i = 0; i < layers; ++i, layer = layer.beyond(1)) {
    for (int row = 0; row < side.rows; ++row) {
      for (int column = 0; column < side.columns; ++column) {
        const Eigen::Vector3i at = layer.voxel(column, row);
        const OverFace place = over(side, out.world_from_index(at.cast<double>()));
        const auto voxel = (std::size_t(at.z()) * out.size[1] + at.y()) * out.size[0] + at.x();
        set_value(out, voxel, value((place.dome_mm - place.above_mm) / side.step_mm));
      }
    }
  }
  return out;
}

}  // namespace

std::vector<CutSide> cut_sides(const Volume& volume, const InsideTest& inside) {
  std::vector<CutSide> sides;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      const Layer last{axis, high ? volume.size[axis] - 1 : 0, high};
      CutSide side = face_of(volume, last);
      mark(side, [&](int column, int row, const Eigen::Vector3d&) {
        return inside(value_at(volume, last.voxel(column, row)));
      });
      if (side.area_mm2 > 0) sides.push_back(std::move(side));
    }
  }
  return sides;
}

std::vector<CutSide> label_cut_sides(const Volume& mask, int number, const LabelBox& box,
                                     const Eigen::Vector3d& stairs, const Volume* scan) {
  // Nearly one and a half voxels outside: where a scan that goes on has a voxel more, though the
  // grids be shifted.
  constexpr double kBeyondFace = 0.9;
  const Label label{mask, number};
  const bool askew = scan && !parallel(mask, *scan);
  std::vector<CutSide> sides;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      const int at = high ? box.first[axis] + box.size[axis] - 1 : box.first[axis];
      const Layer last{axis, at, high};
      const bool at_border = at == (high ? mask.size[axis] - 1 : 0);
      const bool flat = ends_flat(label, box, last, stride_along(axis, mask, stairs));
      const bool own_end = at_border && !scan && !mask.ends_with_label;
      CutSide side = face_of(mask, last);
      const Eigen::Vector3d step = kBeyondFace * side.step_mm * side.axes.col(2);
      std::size_t told = 0;  // pixels behind which a volume ends
      mark(side, [&](int column, int row, const Eigen::Vector3d& face) {
        if (!label.at(last, column, row)) return false;
        const bool ends = own_end || (scan && !askew && !holds(*scan, face + step));
        told += ends;
        return flat || ends;
      });
      side.flat = 2.0 * static_cast<double>(told) * side.pixel_mm.prod() < side.area_mm2;
      if (side.area_mm2 > 0) sides.push_back(std::move(side));
    }
  }
  if (askew) add_ends_of_scan(label, *scan, sides);
  return sides;
}

double tell_cut(const std::vector<CutSide>& sides, SurfaceCap cap, const std::string& whose,
                const RunContext& context) {
  static constexpr const char* kMade[] = {
      "there the surface is cut flat; --cap round closes it as organs end",
      "there it goes on as a dome that no scan has shown", "there the surface is left open"};
  double area_mm2[2] = {0, 0};
  for (const CutSide& side : sides) area_mm2[side.flat] += side.area_mm2;
  for (const bool flat : {false, true}) {
    if (area_mm2[flat] == 0) continue;
    context.warn(whose + (flat ? "the mask ends flat" : "the organ reaches the volume's end") +
                 " over " + to_text(area_mm2[flat] / 100, 1) + " cm²" +
                 (flat ? ", where the organ goes on: " : ": ") + kMade[static_cast<int>(cap)]);
  }
  return area_mm2[0] + area_mm2[1];
}

void raise_domes(std::vector<CutSide>& sides, double organ_mm3) {
  double added_mm3 = 0;
  for (CutSide& side : sides) {
    side.dome_mm = dome_heights(side);
    added_mm3 +=
        std::accumulate(side.dome_mm.begin(), side.dome_mm.end(), 0.0) * side.pixel_mm.prod();
  }
  const double scale = std::min(1.0, kMostAdded * organ_mm3 / std::max(added_mm3, 1e-9));
  for (CutSide& side : sides)
    for (double& height : side.dome_mm) height *= scale;
}

void grow_over_domes(LabelBox& box, const Volume& grid, const std::vector<CutSide>& sides) {
  for (const CutSide& side : sides) {
    const Eigen::Vector3d steps = (highest(side) * grid.direction.transpose() * side.axes.col(2))
                                      .cwiseQuotient(grid.spacing_mm);
    for (int axis = 0; axis < 3; ++axis) {
      const int more = static_cast<int>(std::ceil(std::abs(steps[axis])));
      box.size[axis] += more;
      if (steps[axis] < 0) box.first[axis] -= more;
    }
  }
}

void fill_domes(std::vector<float>& field, LabelBox& box, const Volume& grid,
                const std::vector<CutSide>& sides) {
  const auto [nx, ny, nz] = box.size;
  std::vector<double> added(static_cast<std::size_t>(nz), 0);
  for (const CutSide& side : sides) {
    parallel_for(0, nz, [&, nx = nx, ny = ny](int k) {
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          const Eigen::Vector3d index(i + box.first[0], j + box.first[1], k + box.first[2]);
          const OverFace place = over(side, grid.world_from_index(index));
          if (place.above_mm < 0 || place.dome_mm == 0) continue;
          const double share = (place.dome_mm - place.above_mm) / side.step_mm + 0.5;
          float& voxel = field[(std::size_t(k) * ny + j) * nx + i];
          const float covered = std::clamp(static_cast<float>(share), voxel, 1.0f);
          added[k] += covered - voxel;
          voxel = covered;
        }
      }
    });
  }
  box.label_voxels += std::lround(std::accumulate(added.begin(), added.end(), 0.0));
}

Volume with_domes(const Volume& volume, const std::vector<CutSide>& sides,
                  const std::function<double(double depth)>& value) {
  Volume domed = volume;
  for (const CutSide& side : sides) domed = with_dome(domed, side, value);
  return domed;
}

}  // namespace organbake
