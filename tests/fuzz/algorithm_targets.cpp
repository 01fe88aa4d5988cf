// SPDX-License-Identifier: GPL-3.0-or-later
// What any bytes stand for – meshes sound and damaged, options, instruments – through the
// algorithms: taken or refused like any file, and what comes out holds what is promised of it.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <utility>

#include "fuzz/readers.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/shell.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/viewpoints/placement.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// Reads any bytes as what is wanted next, so that every input means something and a small change of
// it a small change of that. After the last byte there are zeros. Draw one thing
// in a statement: of two arguments compilers draw now the one first, now the other.
class Drawn {
 public:
  explicit Drawn(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::size_t below(std::size_t count);     // 0 … count − 1; count ≤ 2¹⁶
  double between(double low, double high);  // low at first
  double power_of_ten(double low, double high);
  double odd_number();                  // none, none finite, or at the ends of what there is
  Eigen::Vector3d vector(double most);  // each part −most … most

 private:
  unsigned byte();
  unsigned pair();

  std::span<const std::byte> bytes_;
};

unsigned Drawn::byte() {
  if (bytes_.empty()) return 0;
  const auto value = std::to_integer<unsigned>(bytes_.front());
  bytes_ = bytes_.subspan(1);
  return value;
}

unsigned Drawn::pair() {
  const unsigned low = byte();
  return low | byte() << 8;
}

std::size_t Drawn::below(std::size_t count) { return (count <= 256 ? byte() : pair()) % count; }

double Drawn::between(double low, double high) { return low + (high - low) * pair() / 65535.0; }

double Drawn::power_of_ten(double low, double high) { return std::pow(10.0, between(low, high)); }

double Drawn::odd_number() {
  using Limits = std::numeric_limits<double>;
  constexpr double kNumbers[] = {0,      Limits::quiet_NaN(),  Limits::infinity(), -1,    1e300,
                                 1e-300, Limits::denorm_min(), Limits::max(),      -1e300};
  return kNumbers[below(std::size(kNumbers))];
}

Eigen::Vector3d Drawn::vector(double most) {
  const double x = between(-most, most), y = between(-most, most);
  return {x, y, between(-most, most)};
}

TriangleMesh base_mesh(Drawn& drawn) {
  switch (drawn.below(6)) {
    case 0:
      return lumpy_mesh(10, 1);
    case 1:
      return sphere_mesh(10, static_cast<int>(drawn.below(3)));
    case 2:
      return scaled(tetrahedron_mesh(), 10);
    case 3:
      return grid_box(Eigen::Vector3d(8, 10, 12), 1 + static_cast<int>(drawn.below(3)));
    case 4:
      return box_mesh({10, 10, drawn.between(0.01, 10)});
    default: {
      const double radius_mm = drawn.power_of_ten(-1, 2);
      return lumpy_mesh(radius_mm, static_cast<int>(drawn.below(3)));
    }
  }
}

// A vertex in the middle of a face: the mesh stays what it was.
void split_face(TriangleMesh& mesh, std::size_t at) {
  const Face face = mesh.faces[at];
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(
      (mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3);
  mesh.faces[at] = {face[0], face[1], middle};
  mesh.faces.push_back({face[1], face[2], middle});
  mesh.faces.push_back({face[2], face[0], middle});
}

void weld_vertices(TriangleMesh& mesh, std::uint32_t from, std::uint32_t to) {
  for (Face& face : mesh.faces) {
    for (std::uint32_t& corner : face)
      if (corner == from) corner = to;
  }
}

void change(TriangleMesh& mesh, Drawn& drawn) {
  const std::size_t kind = drawn.below(16);
  if (mesh.faces.empty()) return;
  const std::size_t face = drawn.below(mesh.faces.size());
  const std::uint32_t vertex = mesh.faces[face][0];
  if (vertex >= mesh.vertices.size()) return;  // of an earlier change
  for (const std::uint32_t corner : mesh.faces[face])
    if (corner >= mesh.vertices.size()) return;
  switch (kind) {
    case 0:
    case 1:
    case 2:
      mesh.vertices[vertex] += drawn.vector(10);
      break;
    case 3:
    case 4:
      split_face(mesh, face);
      break;
    case 5:
      mesh = scaled(mesh, drawn.power_of_ten(-6, 6));
      break;
    case 6:
      mesh = moved(mesh, drawn.vector(1e5));
      break;
    case 7:
      mesh = joined(mesh, moved(mesh, drawn.vector(30)));
      break;
    case 8: {
      const TriangleMesh other = base_mesh(drawn);
      mesh = joined(mesh, scaled(other, drawn.power_of_ten(-3, 1)));
      break;
    }
    case 9:
      weld_vertices(mesh, vertex, mesh.faces[drawn.below(mesh.faces.size())][1]);
      break;
    case 10:
      std::swap(mesh.faces[face][0], mesh.faces[face][1]);
      break;
    case 11:
      mesh.faces.push_back(mesh.faces[face]);
      break;
    case 12:
      mesh.faces.erase(mesh.faces.begin() + static_cast<std::ptrdiff_t>(face));
      break;
    case 13:
      for (Eigen::Vector3d& v : mesh.vertices) v.y() *= drawn.between(0, 1);
      break;
    case 14:
      mesh.vertices[vertex].x() = drawn.odd_number();
      break;
    default:
      mesh.faces[face][2] = static_cast<std::uint32_t>(drawn.below(4096));
  }
}

// A small solid (4…320 faces, some 10 mm) that stays closed and outward, pushed and bent.
TriangleMesh sound_mesh(Drawn& drawn) {
  TriangleMesh mesh = base_mesh(drawn);
  const Eigen::Vector3d center = bounds(mesh).center();
  for (std::size_t n = drawn.below(4); n-- > 0;) {
    const std::size_t at = drawn.below(mesh.vertices.size());
    mesh.vertices[at] = center + drawn.between(1, 2) * (mesh.vertices[at] - center);
  }
  return mesh;
}

// The same after up to seven changes: most leave a closed mesh closed, others tear it, double or
// turn faces, weld vertices, put bodies side by side, or put in bad numbers and indices.
TriangleMesh grown_mesh(Drawn& drawn) {
  TriangleMesh mesh = base_mesh(drawn);
  for (std::size_t n = drawn.below(8); n-- > 0;) change(mesh, drawn);
  return mesh;
}

template <class Value>
bool same_bytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

// The same work with one thread, then with two: what same() compares is equal to the last bit.
template <class Work, class Same>
auto with_any_threads(const Work& work, const Same& same) {
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return work();
  };
  auto one = with(1);
  expect_invariant(same(one, with(2)), "other bytes with two threads than with one");
  return one;
}

void decimate_mesh(std::span<const std::byte> bytes, const InputFolder&) {
  Drawn drawn(bytes);
  DecimateOptions options;
  options.method = DecimateMethod(drawn.below(3));
  options.faces = 4 + drawn.below(200);
  drawn.below(2);  // was an option that is gone: seeds keep their meshes
  options.flips = drawn.below(2) == 1;
  const TriangleMesh surface = grown_mesh(drawn);
  const DecimateResult made = with_any_threads(
      [&] { return decimate(surface, options); },
      [](const DecimateResult& a, const DecimateResult& b) {
        return same_bytes(a.proxy.vertices, b.proxy.vertices) && a.proxy.faces == b.proxy.faces;
      });
  check_mesh(made.proxy, "proxy");
  expect_invariant(std::isfinite(made.rms_mm + made.max_mm + made.reverse_rms_mm),
                   "a distance is no number");
  expect_invariant(made.proxy.faces.size() <= options.faces, "more faces than asked for");
  const MeshTopology before = analyse_topology(surface), after = analyse_topology(made.proxy);
  if (!before.closed_manifold()) return;
  expect_invariant(after.closed_manifold(), "a closed surface was torn");
  expect_invariant(after.components == before.components, "bodies went or came");
  expect_invariant(after.euler_characteristic ==
                       before.euler_characteristic - static_cast<long>(before.unused_vertices),
                   "handles went or came");
}

bool same_cameras(const Placement& a, const Placement& b) {
  const auto same = [](const PosedCamera& left, const PosedCamera& right) {
    return left.camera_from_world.rotation == right.camera_from_world.rotation &&
           left.camera_from_world.translation == right.camera_from_world.translation &&
           left.intrinsics.fx == right.intrinsics.fx;
  };
  return std::equal(a.cameras.begin(), a.cameras.end(), b.cameras.begin(), b.cameras.end(), same);
}

void place_round_mesh(std::span<const std::byte> bytes, const InputFolder&) {
  Drawn drawn(bytes);
  PlacementOptions options;
  options.count = 1 + static_cast<int>(drawn.below(12));
  options.map_size = 16 + static_cast<int>(drawn.below(48));
  options.field_of_view_rad = drawn.between(0.6, 2);
  if (drawn.below(3) == 2) options.cone = ViewingCone{drawn.vector(1), drawn.between(0.01, 1.57)};
  const TriangleMesh surface = grown_mesh(drawn);
  const Placement made =
      with_any_threads([&] { return place_cameras(surface, options); }, same_cameras);
  for (const PosedCamera& camera : made.cameras) {
    camera.intrinsics.check();
    const Eigen::Matrix3d turn = camera.camera_from_world.rotation;
    expect_invariant((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-9,
                     "a camera that is bent");
    for (const Face& face : surface.faces) {
      const Eigen::Vector2d pixel = project(camera, surface.vertices[face[0]]);
      expect_invariant(pixel.minCoeff() > -0.1 && pixel.maxCoeff() < options.map_size + 0.1,
                       "a vertex outside of a map");
    }
  }
}

void bind_to_mesh(std::span<const std::byte> bytes, const InputFolder&) {
  Drawn drawn(bytes);
  const double reach_mm = drawn.power_of_ten(-2, 3);
  const TriangleMesh proxy = grown_mesh(drawn);
  check_mesh(proxy, "proxy");
  const ShellBinder binder(proxy, reach_mm);
  const std::vector<ShellMatrix> shell = shell_matrices(proxy);
  const Bounds box = bounds(proxy);
  if (!std::isfinite(box.diagonal())) return;  // nothing can be said to be near it
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 16; ++i) {
    const double far = drawn.between(0, 1) * box.diagonal();
    points.push_back(box.center() + far * drawn.vector(1));
  }
  std::vector<ShellBinding> together(points.size());
  binder.bind(points, together);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ShellBinding alone = binder.bind(points[i]);
    for (const ShellBinding& bound : {alone, together[i]}) {
      expect_invariant(bound.face < proxy.faces.size(), "bound to no face");
      const Eigen::Vector3d back =
          shell_point(shell[bound.face], bound.b1, bound.b2, bound.height_mm);
      expect_invariant(back.allFinite(), "bound to no place");
      const double allowed_mm = 1e-6 * (box.diagonal() + box.center().norm());
      if (binder.inside(bound, points[i]))
        expect_invariant((back - points[i]).norm() <= allowed_mm,
                         "a point in a prism is not given back");
    }
  }
}

// N·mm: that of the springs, and that of the masses as they moved in the last step.
double energy(const MechanicsModel& model, const std::vector<Eigen::Vector3d>& now,
              const std::vector<Eigen::Vector3d>& before, double step_s) {
  double sum = 0;
  for (const Spring& spring : model.springs) {
    const double longer_mm = (now[spring.a] - now[spring.b]).norm() - spring.rest_length_mm;
    sum += 0.5 * spring.stiffness_n_per_mm * longer_mm * longer_mm;
  }
  constexpr double kNewtonMillimetres = 1e-3;  // of a kg·mm²/s²
  for (std::size_t v = 0; v < now.size(); ++v)
    sum +=
        0.5 * kNewtonMillimetres * model.mass_kg[v] * ((now[v] - before[v]) / step_s).squaredNorm();
  return sum;
}

struct Steps {
  std::vector<Eigen::Vector3d> positions;  // of all steps, one after the other
  std::vector<double> energies;            // from the release on
};

void step_mesh(std::span<const std::byte> bytes, const InputFolder&) {
  Drawn drawn(bytes);
  MechanicsOptions mechanics;
  mechanics.young_modulus_kpa = drawn.power_of_ten(0, 3);
  mechanics.damping_ratio = drawn.between(0, 2);
  mechanics.anchor_fraction = drawn.between(0, 0.9);
  mechanics.volume_stiffness = 0;  // else it holds energy as well
  DeformOptions options;
  options.time_step_s = drawn.power_of_ten(std::log10(1. / 240), std::log10(1. / 15));
  options.tissue_contacts = drawn.below(2) == 1;
  const TriangleMesh proxy = drawn.below(4) == 3 ? grown_mesh(drawn) : sound_mesh(drawn);
  check_mesh(proxy, "proxy");
  // Copies of a body in one place touch all over: a step of many takes half a second.
  constexpr std::size_t kMostInContact = 400;
  options.tissue_contacts &= proxy.faces.size() <= kMostInContact;
  const MechanicsModel model = make_mechanics(proxy, mechanics);
  const double size_mm = bounds(proxy).diagonal();
  Instrument tip;
  tip.radius_mm = std::max(kThinnestTip_mm, size_mm * drawn.between(0.02, 0.2));
  tip.kind = instrument_kinds()[drawn.below(2)];
  const Eigen::Vector3d from = bounds(proxy).center() + drawn.vector(size_mm);
  const Eigen::Vector3d to = bounds(proxy).center() + drawn.vector(0.3 * size_mm);
  const auto play = [&] {
    Deformer deformer(proxy, model, BaseLayer{}, options);
    Steps steps;
    std::vector<Eigen::Vector3d> before = deformer.positions();
    constexpr int kHeld = 12, kAll = 30;
    for (int i = 0; i < kAll; ++i) {
      tip.active = i < kHeld;
      tip.position_mm = from + (i + 1.0) / kHeld * (to - from);
      before = deformer.positions();
      const StepReport report = deformer.step({tip});
      expect_invariant(!report.recovered, "a step went astray and began anew");
      const auto& now = deformer.positions();
      steps.positions.insert(steps.positions.end(), now.begin(), now.end());
      if (i >= kHeld) steps.energies.push_back(energy(model, now, before, options.time_step_s));
    }
    return steps;
  };
  const Steps made = with_any_threads(
      play, [](const Steps& a, const Steps& b) { return same_bytes(a.positions, b.positions); });
  for (const Eigen::Vector3d& place : made.positions)
    expect_invariant(place.allFinite(), "a vertex of the tissue is no place");
  // What is let go loses energy. Where contacts go on, they may push, too.
  if (options.tissue_contacts) return;
  const double rounding = 1e-9 * mechanics.young_modulus_kpa * size_mm * size_mm * size_mm;
  for (const double later : made.energies)
    expect_invariant(later <= 1.05 * made.energies.front() + rounding,
                     "tissue that was let go gains energy");
}

// Any bytes do; these are some that the targets make much of.
Seeds drawn_seeds() {
  Seeds seeds = {std::string(64, '\0')};
  for (const std::uint64_t n : {0, 1}) {
    RandomStream random(5, n);
    std::string& seed = seeds.emplace_back();
    for (int i = 0; i < 64; ++i) seed += static_cast<char>(random.below(256));
  }
  return seeds;
}

}  // namespace

std::vector<FuzzReader> algorithm_targets() {
  return {
      {"mesh-decimate", decimate_mesh, "", 8, drawn_seeds},
      {"mesh-place", place_round_mesh, "", 60, drawn_seeds},
      {"mesh-bind", bind_to_mesh, "", 60, drawn_seeds},
      {"mesh-step", step_mesh, "", 100, drawn_seeds},
  };
}

}  // namespace organbake
