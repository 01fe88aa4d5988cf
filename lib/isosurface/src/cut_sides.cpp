// SPDX-License-Identifier: GPL-3.0-or-later
// Where the end of a volume cuts an organ, and domes that end it there. The dome's height follows
// the section's distance transform, so that it has the section's own outline, however concave that
// is.
#include "surface_steps.h"

#include <vtkImageData.h>
#include <vtkImageEuclideanDistance.h>
#include <vtkNew.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "organbake/core/text.h"
#include "organbake/core/union_find.h"

namespace organbake {
namespace {

// Half as high as a hemisphere over a round section.
constexpr double kDomeHeight = 0.5;

// The last slice of voxels on one side: across it run the axes u and v.
class Section {
 public:
  Section(const Volume& volume, const CutSide& side)
      : volume_(volume),
        axis_(side.axis),
        u_((side.axis + 1) % 3),
        v_((side.axis + 2) % 3),
        layer_(side.high ? volume.size[side.axis] - 1 : 0) {}

  int columns() const { return volume_.size[u_]; }
  int rows() const { return volume_.size[v_]; }
  double column_mm() const { return volume_.spacing_mm[u_]; }
  double row_mm() const { return volume_.spacing_mm[v_]; }
  Eigen::Vector3i voxel(int column, int row, int beyond = 0) const {
    Eigen::Vector3i at;
    at[axis_] = layer_ + (layer_ == 0 ? -beyond : beyond);
    at[u_] = column;
    at[v_] = row;
    return at;
  }
  // In the world, nearly one and a half voxels outside: where a scan that goes on has a voxel more,
  // though the grids be shifted.
  Eigen::Vector3d beyond(int column, int row) const {
    constexpr double kNearlyHalf = 0.4;
    const Eigen::Vector3d next = voxel(column, row, 1).cast<double>();
    const Eigen::Vector3d last = voxel(column, row).cast<double>();
    return volume_.world_from_index(next + kNearlyHalf * (next - last));
  }
  double value(int column, int row) const {
    const Eigen::Vector3i at = voxel(column, row);
    return volume_.at(at.x(), at.y(), at.z());
  }

 private:
  const Volume& volume_;
  int axis_, u_, v_, layer_;
};

bool ends_at(const Volume& grid, const Eigen::Vector3d& world) {
  const Eigen::Vector3d index = grid.index_from_world(world);
  for (int axis = 0; axis < 3; ++axis) {
    if (index[axis] < -0.5 || index[axis] > grid.size[axis] - 0.5) return true;
  }
  return false;
}

// How far inside the section each of its pixels lies (mm), 0 outside.
std::vector<double> depth_in(const Section& section, const InsideTest& inside) {
  // A ring of pixels that are outside lies around.
  const int columns = section.columns() + 2, rows = section.rows() + 2;
  vtkNew<vtkImageData> image;
  image->SetDimensions(columns, rows, 1);
  image->SetSpacing(section.column_mm(), section.row_mm(), 1);
  image->AllocateScalars(VTK_DOUBLE, 1);
  auto* pixel = static_cast<double*>(image->GetScalarPointer());
  for (int row = -1; row + 1 < rows; ++row) {
    for (int column = -1; column + 1 < columns; ++column, ++pixel) {
      const bool ring =
          row < 0 || column < 0 || row == section.rows() || column == section.columns();
      *pixel = !ring && inside(section.value(column, row)) ? 1 : 0;
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
  const double half_pixel = 0.5 * std::min(section.column_mm(), section.row_mm());
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
std::vector<double> dome_heights(const Section& section, const InsideTest& inside) {
  const std::vector<double> depth = depth_in(section, inside);
  const auto columns = static_cast<std::uint32_t>(section.columns());
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
    heights[i] = kDomeHeight * std::sqrt(depth[i] * (2 * radius[piece[i]] - depth[i]));
  return heights;
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

Volume with_dome(const Volume& volume, const CutSide& side, const InsideTest& inside,
                 const std::function<double(double)>& value) {
  const Section section(volume, side);
  const std::vector<double> heights = dome_heights(section, inside);
  const double step_mm = volume.spacing_mm[side.axis];
  const double highest = *std::max_element(heights.begin(), heights.end());
  const int layers = static_cast<int>(std::ceil(highest / step_mm)) + 2;
  Volume out = grown(volume, side, layers);
  Eigen::Vector3i shift = Eigen::Vector3i::Zero();
  if (!side.high) shift[side.axis] = layers;
  for (int layer = 1; layer <= layers; ++layer) {
    std::size_t pixel = 0;
    for (int row = 0; row < section.rows(); ++row) {
      for (int column = 0; column < section.columns(); ++column, ++pixel) {
        const Eigen::Vector3i at = section.voxel(column, row, layer) + shift;
        const std::size_t voxel =
            (std::size_t(at.z()) * out.size[1] + at.y()) * out.size[0] + at.x();
        // The dome stands on the last slice's outer face, half a voxel from its centres.
        set_value(out, voxel, value(heights[pixel] / step_mm - layer + 0.5));
      }
    }
  }
  return out;
}

}  // namespace

std::vector<CutSide> cut_sides(const Volume& volume, const InsideTest& inside, const Volume* scan) {
  std::vector<CutSide> sides;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      CutSide side{axis, high, 0};
      const Section section(volume, side);
      std::size_t cut = 0;
      for (int row = 0; row < section.rows(); ++row) {
        for (int column = 0; column < section.columns(); ++column) {
          if (!inside(section.value(column, row))) continue;
          cut += scan ? ends_at(*scan, section.beyond(column, row)) : !volume.ends_with_label;
        }
      }
      side.area_mm2 = static_cast<double>(cut) * section.column_mm() * section.row_mm();
      if (cut > 0) sides.push_back(side);
    }
  }
  return sides;
}

double tell_cut(const std::vector<CutSide>& sides, SurfaceCap cap, const std::string& whose,
                const RunContext& context) {
  if (sides.empty()) return 0;
  double area_mm2 = 0;
  for (const CutSide& side : sides) area_mm2 += side.area_mm2;
  static constexpr const char* kMade[] = {
      "there the surface is cut flat; --cap round closes it as organs end",
      "there it goes on as a dome that no scan has shown", "there the surface is left open"};
  context.warn(whose + "the organ reaches the volume's end over " + to_text(area_mm2 / 100, 1) +
               " cm²: " + kMade[static_cast<int>(cap)]);
  return area_mm2;
}

Volume with_domes(const Volume& volume, const std::vector<CutSide>& sides, const InsideTest& inside,
                  const std::function<double(double depth)>& value) {
  Volume domed = volume;
  for (const CutSide& side : sides) domed = with_dome(domed, side, inside, value);
  return domed;
}

}  // namespace organbake
