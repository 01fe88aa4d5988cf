// SPDX-License-Identifier: GPL-3.0-or-later
// The contour of a whole volume from slabs of slices, joined on the slices that they share. VTK's
// filters need half of the volume and three times the mesh beside their input; by slabs that is
// needed for a few slices only.
#include "slab_contour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

namespace organbake {
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
    if (found == shared_.end() || found->first != edge) {
      throw std::logic_error("two slabs differ on the slice that they share");
    }
    return found->second;
  }
  std::uint32_t next_number() {
    if (vertices_ >= std::numeric_limits<std::uint32_t>::max()) {
      throw BadDataError(
          "the surface has more points than a mesh can index; crop or resample the volume");
    }
    return static_cast<std::uint32_t>(vertices_++);
  }

  int columns_;
  std::size_t vertices_ = 0, faces_ = 0;
  SharedVertices shared_;  // of the slice below the next slab
  std::vector<Slab> slabs_;
};

}  // namespace

template <typename Value>
TriangleMesh contour_in_slabs(const CappedField<Value>& field, IsosurfaceMethod method,
                              const RunContext& context, int slices_per_slab) {
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
    welder.add(contour(field.slices(first, count, copy), {nx, ny, count}, field.level(), method),
               first, count);
    context.progress(0.8 * (first + count) / nz);
  }
  copy = {};  // the mesh needs the room
  return welder.take();
}

template TriangleMesh contour_in_slabs(const CappedField<std::int16_t>&, IsosurfaceMethod,
                                       const RunContext&, int);
template TriangleMesh contour_in_slabs(const CappedField<float>&, IsosurfaceMethod,
                                       const RunContext&, int);

}  // namespace organbake
