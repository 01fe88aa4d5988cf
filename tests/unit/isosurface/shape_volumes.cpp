// SPDX-License-Identifier: GPL-3.0-or-later
#include "shape_volumes.h"

#include "organbake/geometry/mesh_checks.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {

Shape ball(const Eigen::Vector3d& center, double radius_mm) {
  return [=](const Eigen::Vector3d& at) { return radius_mm - (at - center).norm(); };
}

Shape asymmetric_organ() {
  return [](const Eigen::Vector3d& at) {
    return std::max({ball({0, 0, 0}, 14)(at), ball({14, 2, 1}, 8)(at), ball({1, 15, 4}, 6)(at),
                     ball({-3, 2, 16}, 4)(at)});
  };
}

Volume grid_around_origin(const Eigen::Vector3d& spacing_mm, double extent_mm,
                          const Eigen::Matrix3d& direction) {
  Volume volume;
  volume.spacing_mm = spacing_mm;
  volume.direction = direction;
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    volume.size[axis] = 2 * static_cast<int>(std::ceil(extent_mm / spacing_mm[axis] / 2)) + 1;
    middle[axis] = (volume.size[axis] - 1) / 2.0 + 0.37;
  }
  volume.origin_mm = -(direction * spacing_mm.cwiseProduct(middle));
  return volume;
}

Eigen::Matrix3d oblique_direction() {
  return (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

std::vector<Eigen::Matrix3d> all_directions() {
  std::vector<Eigen::Matrix3d> all = {Eigen::Matrix3d::Identity(), oblique_direction()};
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 2; ++i) {
      all.push_back(all[static_cast<std::size_t>(i)]);
      all.back().col(axis) *= -1;
    }
  }
  return all;
}

namespace {

Volume filled(const Shape& shape, Volume grid, const std::function<double(double)>& value) {
  for_each_voxel(grid.size, [&](int i, int j, int k) {
    const Eigen::Vector3d world = grid.world_from_index(Eigen::Vector3d(i, j, k));
    grid.voxels.push_back(static_cast<std::int16_t>(std::lround(value(shape(world)))));
  });
  return grid;
}

}  // namespace

Volume scan_of(const Shape& shape, Volume grid) {
  return filled(shape, std::move(grid), [](double inside) {
    return std::clamp(kScanIso_hu + 200 * inside, -1000.0, 100.0);
  });
}

Volume mask_of(const Shape& shape, Volume grid, int label) {
  return filled(shape, std::move(grid), [=](double inside) { return inside > 0 ? label : 0; });
}

Eigen::Vector3d centroid(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double volume = 0;
  for (const Face& face : mesh.faces) {
    const Eigen::Vector3d &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                          &c = mesh.vertices[face[2]];
    const double part = a.dot(b.cross(c)) / 6;
    sum += part * (a + b + c) / 4;
    volume += part;
  }
  return sum / volume;
}

double sphere_volume(double radius_mm) { return 4.0 / 3 * M_PI * std::pow(radius_mm, 3); }

double radius_rms(const TriangleMesh& mesh, double radius_mm) {
  double sum = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) sum += std::pow(v.norm() - radius_mm, 2);
  return std::sqrt(sum / static_cast<double>(mesh.vertices.size()));
}

double radial_normal_rms_deg(const TriangleMesh& mesh) {
  double sum = 0, area = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Face& face = mesh.faces[f];
    const Eigen::Vector3d middle =
        (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3;
    const double cosine = std::clamp(face_normal(mesh, f).dot(middle.normalized()), -1.0, 1.0);
    const double weight = face_area(mesh, f);
    sum += weight * std::pow(std::acos(cosine) * 180 / M_PI, 2);
    area += weight;
  }
  return std::sqrt(sum / area);
}

void expect_closed_and_sound(const TriangleMesh& mesh) {
  const MeshTopology topology = analyse_topology(mesh);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.degenerate_faces, 0u);
  EXPECT_EQ(topology.unused_vertices, 0u);
  EXPECT_GT(signed_volume(mesh), 0);
  EXPECT_NO_THROW(check_mesh(mesh, "surface"));
}

}  // namespace organbake
