// SPDX-License-Identifier: GPL-3.0-or-later
// Edge collapses in the order of their cost, by two libraries: Lindstrom & Turk's memoryless cost
// (1998) with CGAL, which keeps volume and is what proxies start from, and Garland & Heckbert's
// quadrics (1997) with OpenMesh, the usual one, to compare with.
#include "organbake/decimate/decimate.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/boost/graph/Euler_operations.h>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>
#include <stdexcept>

#include "organbake/decimate/mesh_measures.h"
#include "proxies.h"

namespace organbake {
namespace {

namespace simplification = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;  // Lindstrom–Turk needs no exact arithmetic
using HalfEdgeMesh = CGAL::Surface_mesh<Kernel::Point_3>;

HalfEdgeMesh to_half_edges(const TriangleMesh& mesh, const UnitFrame& frame) {
  HalfEdgeMesh result;
  result.reserve(mesh.vertices.size(), mesh.faces.size() * 3 / 2 + 1, mesh.faces.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    const Eigen::Vector3d p = frame.into(vertex);
    result.add_vertex({p.x(), p.y(), p.z()});
  }
  using Vertex = HalfEdgeMesh::Vertex_index;
  for (const Face& f : mesh.faces) {
    if (result.add_face(Vertex(f[0]), Vertex(f[1]), Vertex(f[2])) == HalfEdgeMesh::null_face()) {
      throw std::logic_error("collapse_edges: the surface is not manifold");
    }
  }
  return result;
}

// Isosurfaces through sample points have edges without length; the cost is undefined there.
void collapse_edges_without_length(HalfEdgeMesh& mesh) {
  for (const auto edge : mesh.edges()) {
    if (mesh.is_removed(edge)) continue;
    const auto half = mesh.halfedge(edge);
    if (mesh.point(mesh.source(half)) == mesh.point(mesh.target(half)) &&
        CGAL::Euler::does_satisfy_link_condition(edge, mesh)) {
      CGAL::Euler::collapse_edge(edge, mesh);
    }
  }
}

// Where the surface is flat, all collapses cost the same, and one vertex may swallow all: none that
// gives a vertex more neighbours than this. Curved surfaces hardly ever come near it.
class BoundedPlacement {
 public:
  template <typename Profile>
  auto operator()(const Profile& profile) const {
    constexpr std::size_t kMostNeighbours = 64;
    using MaybePlace = decltype(placement_(profile));  // boost's optional, from CGAL 6 on std's
    return profile.link().size() > kMostNeighbours ? MaybePlace() : placement_(profile);
  }

 private:
  simplification::LindstromTurk_placement<HalfEdgeMesh> placement_;
};

// CGAL's own predicates count edges, which says how many faces only for a closed surface.
class StopAtFaces {
 public:
  StopAtFaces(std::size_t faces, std::size_t from, const RunContext& context)
      : faces_(faces), from_(from), context_(&context) {}

  template <typename Cost, typename Profile>
  bool operator()(const Cost&, const Profile& profile, std::size_t, std::size_t) const {
    const std::size_t left = profile.surface_mesh().number_of_faces();
    constexpr std::size_t kReportEvery = 2048;
    if (left % kReportEvery < 2) {
      context_->throw_if_cancelled();
      context_->progress(double(from_ - left) / double(from_ - faces_));
    }
    return left <= faces_;
  }

 private:
  std::size_t faces_, from_;
  const RunContext* context_;
};

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using DoubleMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

// OpenMesh asks it now and then whether to go on.
class CancelObserver : public OpenMesh::Decimater::Observer {
 public:
  explicit CancelObserver(const RunContext& context) : Observer(1024), context_(context) {}
  void notify(std::size_t) override {}
  bool abort() const override { return context_.cancelled(); }

 private:
  const RunContext& context_;
};

DoubleMesh to_half_edges(const TriangleMesh& mesh, const Eigen::Vector3d& center) {
  DoubleMesh result;
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    const Eigen::Vector3d p = vertex - center;  // quadrics far from the origin would cancel
    result.add_vertex({p.x(), p.y(), p.z()});
  }
  const auto vertex = [](std::uint32_t v) { return OpenMesh::VertexHandle(static_cast<int>(v)); };
  for (const Face& f : mesh.faces) result.add_face(vertex(f[0]), vertex(f[1]), vertex(f[2]));
  return result;
}

TriangleMesh from_half_edges(DoubleMesh& mesh, const Eigen::Vector3d& center) {
  mesh.garbage_collection();
  TriangleMesh result;
  for (const auto vertex : mesh.vertices()) {
    const OpenMesh::Vec3d& p = mesh.point(vertex);
    result.vertices.push_back(Eigen::Vector3d(p[0], p[1], p[2]) + center);
  }
  for (const auto face : mesh.faces()) {
    Face corners{};
    int c = 0;
    for (const auto vertex : mesh.fv_range(face)) {
      corners[c++] = static_cast<std::uint32_t>(vertex.idx());
    }
    result.faces.push_back(corners);
  }
  return result;
}

}  // namespace

TriangleMesh collapse_edges(const TriangleMesh& surface, std::size_t faces,
                            const RunContext& context) {
  const UnitFrame frame(surface);
  HalfEdgeMesh mesh = to_half_edges(surface, frame);
  if (mesh.number_of_faces() > faces) collapse_edges_without_length(mesh);
  if (mesh.number_of_faces() > faces) {
    simplification::edge_collapse(
        mesh, StopAtFaces(faces, mesh.number_of_faces(), context),
        CGAL::parameters::get_cost(simplification::LindstromTurk_cost<HalfEdgeMesh>())
            .get_placement(BoundedPlacement()));
  }
  mesh.collect_garbage();
  return triangles_of(mesh, [&](const Kernel::Point_3& p) {
    return frame.back(Eigen::Vector3d(p.x(), p.y(), p.z()));
  });
}

TriangleMesh collapse_by_quadrics(const TriangleMesh& surface, std::size_t faces,
                                  const RunContext& context) {
  const Eigen::Vector3d center = bounds(surface).center();
  DoubleMesh mesh = to_half_edges(surface, center);
  mesh.request_face_normals();
  mesh.update_face_normals();
  CancelObserver observer(context);
  OpenMesh::Decimater::DecimaterT<DoubleMesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<DoubleMesh>::Handle quadric;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();
  decimater.set_observer(&observer);
  decimater.initialize();
  decimater.decimate_to_faces(0, faces);
  context.throw_if_cancelled();
  return from_half_edges(mesh, center);
}

}  // namespace organbake
