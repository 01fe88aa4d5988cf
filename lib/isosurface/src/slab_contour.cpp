// SPDX-License-Identifier: GPL-3.0-or-later
// What is contoured of a volume whose surface reaches its border: one layer of mirrored values
// closes it half a voxel beyond the last voxels, flat and without a second rule for caps.
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "organbake/contour/contour.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "surface_steps.h"

namespace organbake {
namespace {

bool inside(int i, int n) { return i >= 0 && i < n; }

template <typename Value>
Value clamped(double value) {
  using Limits = std::numeric_limits<Value>;
  return static_cast<Value>(std::clamp<double>(value, Limits::lowest(), Limits::max()));
}

// The nearest values to the level, below and above, that VTK's single-precision points tell from
// it.
template <typename Value>
std::pair<Value, Value> nearest_allowed(double level, double least) {
  if constexpr (std::is_integral_v<Value>) {
    // Whole numbers are half a unit from the level. A data range far beyond a CT's needs more.
    const double whole = std::max(1.0, std::ceil(least + 0.5));
    return {clamped<Value>(std::floor(level - whole + 0.5)),
            clamped<Value>(std::ceil(level + whole - 0.5))};
  } else {
    const auto middle = static_cast<Value>(level);
    const Value least_ulp = std::numeric_limits<Value>::epsilon() * std::abs(middle);
    const Value away = std::max(static_cast<Value>(least), least_ulp);
    return {middle - away, middle + away};
  }
}

}  // namespace

template <typename Value>
CappedField<Value>::CappedField(std::span<const Value> values, const std::array<int, 3>& size,
                                const ValueRange& range, double level, bool cap)
    : values_(values), volume_size_(size), level_(level) {
  margin_ = cap && reaches_border() ? 1 : 0;
  for (int axis = 0; axis < 3; ++axis) size_[axis] = size[axis] + 2 * margin_;
  const double least = (range.max - range.min) * least_distance_to_level(size_);
  std::tie(below_, above_) = nearest_allowed<Value>(level, least);
  as_they_are_ = std::is_integral_v<Value> && above_ - below_ <= 1;
  air_ = below_;
  not_measured_ =
      range.min < level ? clamped<Value>(range.min) : clamped<Value>(2 * level - range.max);
}

template <typename Value>
bool CappedField<Value>::reaches_border() const {
  const auto [nx, ny, nz] = volume_size_;
  for (int k = 0; k < nz; ++k) {
    const bool outer_slice = k == 0 || k == nz - 1;
    for (int j = 0; j < ny; ++j) {
      const bool whole_row = outer_slice || j == 0 || j == ny - 1;
      const int step = whole_row ? 1 : std::max(1, nx - 1);
      const std::size_t row = (std::size_t(k) * ny + j) * nx;
      for (int i = 0; i < nx; i += step)
        if (values_[row + i] >= level_) return true;
    }
  }
  return false;
}

template <typename Value>
std::span<const Value> CappedField<Value>::slices(int first, int count,
                                                  std::vector<Value>& copy) const {
  const std::size_t slice = static_cast<std::size_t>(size_[0]) * size_[1];
  const std::size_t voxels = slice * static_cast<std::size_t>(count);
  if (as_they_are_ && margin_ == 0) return values_.subspan(slice * std::size_t(first), voxels);
  copy.resize(voxels);
  parallel_for(0, count, [&](int k) {
    for (int j = 0; j < size_[1]; ++j)
      fill_row(j - margin_, first + k - margin_, &copy[(std::size_t(k) * size_[1] + j) * size_[0]]);
  });
  return copy;
}

template <typename Value>
Value CappedField<Value>::keep_away(Value value) const {
  if constexpr (!std::is_integral_v<Value>) {
    if (std::isnan(value)) value = not_measured_;
  }
  return value >= level_ ? std::max(value, above_) : std::min(value, below_);
}

// Air stays air: only tissue is mirrored.
template <typename Value>
Value CappedField<Value>::mirrored(Value value) const {
  const Value kept = keep_away(value);
  return kept < level_ ? air_ : clamped<Value>(2 * level_ - kept);
}

// Row (j, k) of the volume, possibly just outside it. The grid's edges and corners are air.
template <typename Value>
void CappedField<Value>::fill_row(int j, int k, Value* out) const {
  const auto [nx, ny, nz] = volume_size_;
  const bool j_inside = inside(j, ny), k_inside = inside(k, nz);
  if (!j_inside && !k_inside) {
    std::fill_n(out, size_[0], air_);
    return;
  }
  const std::size_t nearest = std::size_t(std::clamp(k, 0, nz - 1)) * ny + std::clamp(j, 0, ny - 1);
  const Value* row = &values_[nearest * nx];
  const bool is_inside = j_inside && k_inside;
  if (!is_inside) {
    std::transform(row, row + nx, out + margin_, [&](Value v) { return mirrored(v); });
  } else if (as_they_are_) {
    std::copy(row, row + nx, out + margin_);
  } else {
    std::transform(row, row + nx, out + margin_, [&](Value v) { return keep_away(v); });
  }
  if (margin_ == 0) return;
  out[0] = is_inside ? mirrored(row[0]) : air_;
  out[nx + 1] = is_inside ? mirrored(row[nx - 1]) : air_;
}

template class CappedField<std::int16_t>;
template class CappedField<float>;

// The contour of a whole volume from slabs of slices, joined on the slices that they share. VTK's
// filters need half of the volume and three times the mesh beside their input; by slabs that is
// needed for a few slices only.
namespace {

// Large enough for the shared slices to cost little, small beside any volume that matters.
constexpr std::size_t kVoxelsOfSlab = std::size_t{1} << 22;
constexpr int kLeastSlices = 8;

// One slab's part of the mesh, as small as it can be: the whole mesh exists twice for a moment.
struct Slab {
  int first_slice = 0;
  std::vector<Eigen::Vector3f> vertices;  // new ones, z counted from first_slice
  std::vector<Face> faces;                // of the whole mesh's vertices
};

// Vertices on a shared slice, by the edge of the grid that they lie on.
using SharedVertices = std::vector<std::pair<std::uint64_t, std::uint32_t>>;

std::uint64_t edge_in_slice(const Eigen::Vector3d& vertex, int columns) {
  const double i = std::floor(vertex.x()), j = std::floor(vertex.y());
  const std::uint64_t along_y = vertex.x() == i ? 1 : 0;
  return (static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(columns) +
          static_cast<std::uint64_t>(i)) *
             2 +
         along_y;
}

class SlabWelder {
 public:
  explicit SlabWelder(int columns) : columns_(columns) {}

  void add(TriangleMesh mesh, int first_slice, int slices) {
    Slab slab;
    slab.first_slice = first_slice;
    const std::vector<std::uint32_t> number = number_vertices(mesh, slices, slab);
    slab.faces = std::move(mesh.faces);
    parallel_for(std::size_t{0}, slab.faces.size(), [&](std::size_t f) {
      for (std::uint32_t& corner : slab.faces[f]) corner = number[corner];
    });
    faces_ += slab.faces.size();
    slabs_.push_back(std::move(slab));
  }

  TriangleMesh take() {
    TriangleMesh mesh;
    mesh.vertices.reserve(vertices_);
    mesh.faces.reserve(faces_);
    for (Slab& slab : slabs_) {
      const Eigen::Vector3d shift(0, 0, slab.first_slice);
      for (const Eigen::Vector3f& v : slab.vertices)
        mesh.vertices.push_back(v.cast<double>() + shift);
      mesh.faces.insert(mesh.faces.end(), slab.faces.begin(), slab.faces.end());
      slab = {};
    }
    return mesh;
  }

 private:
  std::vector<std::uint32_t> number_vertices(const TriangleMesh& mesh, int slices, Slab& slab) {
    std::vector<std::uint32_t> number(mesh.vertices.size());
    SharedVertices top;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Eigen::Vector3d& vertex = mesh.vertices[v];
      if (vertex.z() == 0 && !shared_.empty()) {
        number[v] = number_of_shared(vertex);
        continue;
      }
      number[v] = next_number();
      slab.vertices.push_back(vertex.cast<float>());
      if (vertex.z() == slices - 1) top.emplace_back(edge_in_slice(vertex, columns_), number[v]);
    }
    std::sort(top.begin(), top.end());
    shared_ = std::move(top);
    return number;
  }
  std::uint32_t number_of_shared(const Eigen::Vector3d& vertex) const {
    const std::uint64_t edge = edge_in_slice(vertex, columns_);
    const auto found =
        std::lower_bound(shared_.begin(), shared_.end(), std::pair(edge, std::uint32_t{0}));
    if (found == shared_.end() || found->first != edge)
      throw std::logic_error("two slabs differ on the slice that they share");
    return found->second;
  }
  std::uint32_t next_number() {
    if (vertices_ >= std::numeric_limits<std::uint32_t>::max())
      throw BadDataError(
          "the surface has more points than a mesh can index; crop or resample the volume");
    return static_cast<std::uint32_t>(vertices_++);
  }

  int columns_;
  std::size_t vertices_ = 0, faces_ = 0;
  SharedVertices shared_;  // of the slice below the next slab
  std::vector<Slab> slabs_;
};

}  // namespace

template <typename Value>
TriangleMesh contour_in_slabs(const CappedField<Value>& field, const RunContext& context,
                              int slices_per_slab) {
  const auto [nx, ny, nz] = field.size();
  const std::size_t slice = static_cast<std::size_t>(nx) * ny;
  const int thickness =
      slices_per_slab > 0
          ? std::max(2, slices_per_slab)
          : std::max(kLeastSlices,
                     static_cast<int>(std::min<std::size_t>(kVoxelsOfSlab / slice, nz)));
  SlabWelder welder(nx);
  std::vector<Value> copy;
  for (int first = 0; first < nz - 1; first += thickness - 1) {
    context.throw_if_cancelled();
    const int count = std::min(thickness, nz - first);
    welder.add(contour(field.slices(first, count, copy), {nx, ny, count}, field.level()), first,
               count);
    context.progress(0.8 * (first + count) / nz);
  }
  copy = {};  // the mesh needs the room
  return welder.take();
}

template TriangleMesh contour_in_slabs(const CappedField<std::int16_t>&, const RunContext&, int);
template TriangleMesh contour_in_slabs(const CappedField<float>&, const RunContext&, int);

}  // namespace organbake
