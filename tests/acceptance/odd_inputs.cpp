// SPDX-License-Identifier: GPL-3.0-or-later
#include "probes.h"

#include "organbake/phantom/phantom.h"
#include "support/testing.h"

namespace organbake {
namespace {

std::size_t any_vertex(const TriangleMesh& mesh, RandomStream& random) {
  return random.below(mesh.vertices.size());
}

std::size_t any_face(const TriangleMesh& mesh, RandomStream& random) {
  return random.below(mesh.faces.size());
}

void spoil(TriangleMesh& mesh, RandomStream& random) {
  if (mesh.faces.empty()) return;
  enum { far, scale, flat, mirror, tear, twice, flip, no_area, spike, none, index, number, split };
  switch (random.below(13)) {
    case far:
      for (const double mm = any_size(random, 0, 7); auto& v : mesh.vertices) v.x() += mm;
      break;
    case scale:
      for (const double by = any_size(random, -7, 7); auto& v : mesh.vertices) v *= by;
      break;
    case flat:
      for (const double by = chance(random, 0.5) ? 0 : any_size(random, -9, 0);
           auto& v : mesh.vertices)
        v.y() *= by;
      break;
    case mirror:
      for (auto& v : mesh.vertices) v.z() = -v.z();
      break;
    case tear:
      mesh.faces.resize(1 + random.below(mesh.faces.size()));
      break;
    case twice:
      mesh.faces.push_back(mesh.faces[any_face(mesh, random)]);
      break;
    case flip: {
      Face& face = mesh.faces[any_face(mesh, random)];
      std::swap(face[0], face[1]);
      break;
    }
    case no_area: {
      Face& face = mesh.faces[any_face(mesh, random)];
      face[1] = face[0];
      break;
    }
    case spike:
      mesh.vertices[any_vertex(mesh, random)] *= any_size(random, 1, 4);
      break;
    case none:
      if (chance(random, 0.5)) mesh.faces.clear();
      if (chance(random, 0.5)) mesh.vertices.clear(), mesh.colors.clear();
      break;
    case index:
      mesh.faces[any_face(mesh, random)][0] = std::uint32_t(random());
      break;
    case number:
      mesh.vertices[any_vertex(mesh, random)].x() = odd_number(random);
      break;
    case split:  // every triangle apart, as STL keeps it
      TriangleMesh apart;
      for (const Face& face : mesh.faces) {
        for (const std::uint32_t corner : face) {
          if (corner >= mesh.vertices.size()) return;
          apart.vertices.push_back(mesh.vertices[corner]);
          if (corner < mesh.colors.size()) apart.colors.push_back(mesh.colors[corner]);
        }
        const auto n = std::uint32_t(apart.vertices.size());
        apart.faces.push_back({n - 3, n - 2, n - 1});
      }
      if (apart.colors.size() != apart.vertices.size()) apart.colors.clear();
      mesh = std::move(apart);
      break;
  }
}

}  // namespace

bool chance(RandomStream& random, double share) { return random.uniform() < share; }

double any_size(RandomStream& random, double low, double high) {
  return std::pow(10.0, random.uniform(low, high));
}

double odd_number(RandomStream& random) {
  using Limits = std::numeric_limits<double>;
  const double numbers[] = {Limits::quiet_NaN(),
                            Limits::infinity(),
                            -Limits::infinity(),
                            0,
                            -1,
                            Limits::denorm_min(),
                            Limits::max(),
                            1e300,
                            -1e300,
                            1e-300};
  return numbers[random.below(std::size(numbers))];
}

Eigen::Vector3d any_direction(RandomStream& random) {
  const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * std::numbers::pi);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Eigen::Vector3d any_point(RandomStream& random, double most_mm) {
  Eigen::Vector3d point = random.uniform(0, most_mm) * any_direction(random);
  if (chance(random, 0.1)) point[Eigen::Index(random.below(3))] = odd_number(random);
  return point;
}

TriangleMesh sound_organ(RandomStream& random) {
  OrganPhantomOptions options;
  options.seed = random.below(8);
  options.ct_size = {64, 64, 64};
  return OrganPhantom(options).surface(1 + int(random.below(3)));
}

TriangleMesh any_organ(RandomStream& random) {
  TriangleMesh mesh = sound_organ(random);
  const std::uint64_t changes = random.below(4);
  for (std::uint64_t i = 0; i < changes; ++i) spoil(mesh, random);
  return mesh;
}

PosedCamera camera_round(RandomStream& random, const Bounds& box, int size) {
  PosedCamera camera;
  camera.name = "camera";
  const double focal = size * random.uniform(0.8, 3), radius = 0.5 * box.diagonal();
  camera.intrinsics = {size, size, focal, focal, 0.5 * size, 0.5 * size};
  const Eigen::Vector3d forward = any_direction(random);
  const Eigen::Vector3d right = forward.unitOrthogonal();
  camera.camera_from_world.rotation.row(0) = right.transpose();
  camera.camera_from_world.rotation.row(1) = forward.cross(right).transpose();
  camera.camera_from_world.rotation.row(2) = forward.transpose();
  const double distance = radius * (1.1 + 2 * focal / size);
  camera.camera_from_world.translation =
      -(camera.camera_from_world.rotation * (box.center() - distance * forward));
  return camera;
}

}  // namespace organbake
