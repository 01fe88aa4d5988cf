// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/collapse.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>

namespace organbake {
namespace {

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
