// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "decimate/decimate.h"
#include "geometry/camera.h"
#include "geometry/shell_map.h"
#include "mechanics/mechanics.h"
#include "organbench/bench.h"
#include "organbench/suites.h"
#include "phantom/phantom.h"
#include "phantom/shading_surfaces.h"
#include "shading/fast_sweeping.h"
#include "viewpoints/placement.h"

// What every stage's kernel would lose, or does, when it counts in single precision: the same
// formula in both, on the same inputs, double taken for the truth.
namespace organbake {
namespace {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix36 = Eigen::Matrix<T, 3, 6>;

constexpr std::uint64_t kPrecisionSeed = 11;
constexpr std::size_t kInputs = 10'000;

struct Kernel {
  std::string stage, ours;  // ours: what the product counts in there
  std::string unit;
  double scale = 1;  // of what is computed, in its unit: digits are digits of this
  std::vector<double> differences = {};
};

void tell(Bench& bench, Kernel kernel) {
  const double single_digits = -std::log10(std::ldexp(1.0, -24));  // half a unit in the last place
  const Spread spread = spread_of(std::move(kernel.differences));
  const auto kept = [&](double difference) {
    return std::min(single_digits, -std::log10(difference / kernel.scale));
  };
  bench.add(
      Point{"single precision against double, " + std::to_string(kInputs) + " inputs or one large",
            kernel.stage + " (ours: " + kernel.ours + ")",
            false,
            {},
            {},
            {{"digits kept, median", "", kept(spread.median)},
             {"digits kept, worst", "", kept(spread.most)},
             {"digits lost, worst", "", single_digits - kept(spread.most)},
             {"largest difference", kernel.unit, spread.most}}});
}

// Both precisions' results of every input, compared by `distance`.
template <class Single, class Double, class Distance>
void compare(Bench& bench, Kernel kernel, const Single& in_single, const Double& in_double,
             const Distance& distance) {
  bench.now(kernel.stage);
  for (std::size_t i = 0; i < kInputs; ++i)
    kernel.differences.push_back(distance(in_single(i), in_double(i)));
  tell(bench, std::move(kernel));
}

// The phantom, its proxy, cameras, and points of the surface bound to the proxy.
struct BoundOrgan {
  BoundOrgan() {
    surface = OrganPhantom({}).surface(5);
    DecimateOptions quadric;
    quadric.method = DecimateMethod::quadric;
    proxy = decimate(surface, quadric).proxy;
    cameras = place_cameras(surface, {}).cameras;
    shells = shell_matrices(proxy);
    size_mm = bounds(surface).diagonal();
    const ShellBinder binder(proxy, size_mm);
    RandomStream random(kPrecisionSeed);
    for (std::size_t i = 0; i < kInputs; ++i) {
      points.push_back(surface.vertices[random.below(surface.vertices.size())]);
      bindings.push_back(binder.bind(points.back()));
    }
  }
  const ShellMatrix& shell(std::size_t i) const { return shells[bindings[i].face]; }

  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
  std::vector<ShellMatrix> shells;
  double size_mm = 0;
  std::vector<Eigen::Vector3d> points;
  std::vector<ShellBinding> bindings;
};

template <class T>
Vector3<T> carried(const ShellMatrix& shell, const ShellBinding& at) {
  const Matrix36<T> m = shell.cast<T>();
  const T b1 = T(at.b1), b2 = T(at.b2), h = T(at.height_mm);
  return m.col(0) + b1 * m.col(1) + b2 * m.col(2) + h * (m.col(3) + b1 * m.col(4) + b2 * m.col(5));
}

// b1, b2 of a point at a known height, by normal equations.
template <class T>
Eigen::Matrix<T, 2, 1> found_again(const ShellMatrix& shell, double height,
                                   const Eigen::Vector3d& point) {
  const Matrix36<T> m = shell.cast<T>();
  const T h = T(height);
  Eigen::Matrix<T, 3, 2> edges;
  edges.col(0) = m.col(1) + h * m.col(4);
  edges.col(1) = m.col(2) + h * m.col(5);
  const Vector3<T> d = point.cast<T>() - m.col(0) - h * m.col(3);
  return (edges.transpose() * edges).inverse() * (edges.transpose() * d);
}

void compare_shells(Bench& bench, const BoundOrgan& organ) {
  const auto apart_mm = [](const auto& a, const Eigen::Vector3d& b) {
    return (a.template cast<double>() - b).norm();
  };
  compare(
      bench,
      {"shell map: a bound sample carried", "single in frames, double in baking", "mm",
       organ.size_mm},
      [&](std::size_t i) { return carried<float>(organ.shell(i), organ.bindings[i]); },
      [&](std::size_t i) { return carried<double>(organ.shell(i), organ.bindings[i]); }, apart_mm);
  const auto point_of = [&]<class T>(T, std::size_t i) -> Eigen::Vector3d {
    const double h = organ.bindings[i].height_mm;
    const auto b = found_again<T>(organ.shell(i), h, organ.points[i]);
    return shell_point(organ.shell(i), b[0], b[1], h);
  };
  compare(
      bench, {"shell binding: b1, b2 at a known height", "double", "mm", organ.size_mm},
      [&](std::size_t i) { return point_of(0.0F, i); },
      [&](std::size_t i) { return point_of(0.0, i); }, apart_mm);
}

// Where a bound sample lands in a camera's map, px.
template <class T>
Eigen::Matrix<T, 2, 1> landing(const PosedCamera& camera, const ShellMatrix& shell,
                               const ShellBinding& at) {
  const RigidTransform& pose = camera.camera_from_world;
  ShellMatrix in_camera = pose.rotation * shell;
  in_camera.col(0) += pose.translation;
  const Vector3<T> p = carried<T>(in_camera, at);
  const Intrinsics& k = camera.intrinsics;
  return {T(k.fx) * p.x() / p.z() + T(k.cx), T(k.fy) * p.y() / p.z() + T(k.cy)};
}

void compare_landing(Bench& bench, const BoundOrgan& organ) {
  const auto camera = [&](std::size_t i) -> const PosedCamera& {
    return organ.cameras[i % organ.cameras.size()];
  };
  const double width = organ.cameras.front().intrinsics.width;
  compare(
      bench, {"warp: where a sample lands", "single", "px", width},
      [&](std::size_t i) { return landing<float>(camera(i), organ.shell(i), organ.bindings[i]); },
      [&](std::size_t i) { return landing<double>(camera(i), organ.shell(i), organ.bindings[i]); },
      [](const auto& a, const auto& b) { return (a.template cast<double>() - b).norm(); });
}

// Planar depth at which a ray of the camera meets a face's plane, mm.
template <class T>
T plane_depth(const TriangleMesh& mesh, const Face& face, const Eigen::Vector3d& eye,
              const Eigen::Vector3d& direction) {
  const Vector3<T> a = mesh.vertices[face[0]].cast<T>(), b = mesh.vertices[face[1]].cast<T>(),
                   c = mesh.vertices[face[2]].cast<T>();
  const Vector3<T> normal = (b - a).cross(c - a);
  return normal.dot(a - eye.cast<T>()) / normal.dot(direction.cast<T>());
}

void compare_depths(Bench& bench, const BoundOrgan& organ) {
  constexpr double kSteepest = 0.17;  // cosine: captures trust no surface beyond 80°
  const PosedCamera& camera = organ.cameras.front();
  const Eigen::Vector3d eye = camera.center_world_mm(), forward = camera.view_direction_world();
  std::vector<std::size_t> facing;
  for (std::size_t f = 0; f < organ.surface.faces.size(); ++f) {
    const Eigen::Vector3d toward = eye - organ.surface.vertices[organ.surface.faces[f][0]];
    if (face_normal(organ.surface, f).dot(toward.normalized()) > kSteepest) facing.push_back(f);
  }
  const auto depth = [&]<class T>(T, std::size_t i) -> double {
    const Face& face = organ.surface.faces[facing[i % facing.size()]];
    const Eigen::Vector3d to = organ.surface.vertices[face[0]] - eye;
    return plane_depth<T>(organ.surface, face, eye, to / to.dot(forward));
  };
  compare(
      bench,
      {"depth map: a ray meets a face", "single", "mm",
       (bounds(organ.surface).center() - eye).norm()},
      [&](std::size_t i) { return depth(0.0F, i); }, [&](std::size_t i) { return depth(0.0, i); },
      [](double a, double b) { return std::abs(a - b); });
}

// How far a point 0.1 mm above a vertex is from the planes round it, by their summed quadric.
template <class T>
T quadric_distance(const TriangleMesh& mesh, const std::vector<std::size_t>& faces,
                   const Eigen::Vector3d& at) {
  Eigen::Matrix<T, 4, 4> quadric = Eigen::Matrix<T, 4, 4>::Zero();
  for (const std::size_t f : faces) {
    const Eigen::Vector3d n = face_normal(mesh, f);
    Eigen::Matrix<T, 4, 1> plane;
    plane << n.cast<T>(), T(-n.dot(mesh.vertices[mesh.faces[f][0]]));
    quadric += plane * plane.transpose();
  }
  Eigen::Matrix<T, 4, 1> x;
  x << at.cast<T>(), T(1);
  return std::sqrt(std::max(T(0), x.dot(quadric * x) / T(faces.size())));
}

void compare_quadrics(Bench& bench, const BoundOrgan& organ) {
  std::vector<std::vector<std::size_t>> faces_round(organ.surface.vertices.size());
  for (std::size_t f = 0; f < organ.surface.faces.size(); ++f)
    for (const std::uint32_t v : organ.surface.faces[f]) faces_round[v].push_back(f);
  const auto normals = vertex_normals(organ.surface);
  const auto distance = [&]<class T>(T, std::size_t i) -> double {
    const std::size_t v = i % organ.surface.vertices.size();
    return quadric_distance<T>(organ.surface, faces_round[v],
                               organ.surface.vertices[v] + 0.1 * normals[v]);
  };
  compare(
      bench, {"decimate: a quadric's distance", "double", "mm", organ.size_mm},
      [&](std::size_t i) { return distance(0.0F, i); },
      [&](std::size_t i) { return distance(0.0, i); },
      [](double a, double b) { return std::abs(a - b); });
}

// The displacements that random forces of up to 1 N a vertex bring in one implicit step, mm.
template <class T>
Eigen::MatrixXd pushed(const TriangleMesh& proxy, const MechanicsModel& model) {
  constexpr double kStep_s = 1.0 / 60, kMilli = 1000;  // units: kg, mm, s, so mN
  using Matrix = Eigen::SparseMatrix<T>;
  std::vector<Eigen::Triplet<T>> entries;
  const auto add = [&](std::uint32_t i, std::uint32_t j, double value) {
    entries.emplace_back(int(i), int(j), T(value));
  };
  const auto size = std::uint32_t(proxy.vertices.size());
  for (std::uint32_t v = 0; v < size; ++v) add(v, v, model.mass_kg[v] / (kStep_s * kStep_s));
  for (const Spring& spring : model.springs) {
    const double k = kMilli * spring.stiffness_n_per_mm;
    add(spring.a, spring.a, k), add(spring.b, spring.b, k);
    add(spring.a, spring.b, -k), add(spring.b, spring.a, -k);
  }
  Matrix matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic> forces(size, 3);
  RandomStream random(kPrecisionSeed);
  for (std::uint32_t v = 0; v < size; ++v)
    for (int c = 0; c < 3; ++c) forces(v, c) = T(kMilli * random.uniform(-1, 1));
  return Eigen::SimplicialLDLT<Matrix>(matrix).solve(forces).template cast<double>();
}

void compare_deformation(Bench& bench) {
  bench.now("deformation");
  const TriangleMesh proxy = OrganPhantom({}).surface(3);
  const MechanicsModel model = make_mechanics(proxy, {});
  const Eigen::MatrixXd single = pushed<float>(proxy, model), exact = pushed<double>(proxy, model);
  Kernel kernel{
      "deformation: factor and solve, " + std::to_string(proxy.vertices.size()) + " vertices",
      "factor in double, solve in single", "mm", exact.rowwise().norm().maxCoeff()};
  for (Eigen::Index v = 0; v < exact.rows(); ++v)
    kernel.differences.push_back((single.row(v) - exact.row(v)).norm());
  tell(bench, std::move(kernel));
}

template <class T>
Grid<T> swept(const NearScene& scene) {
  constexpr int kMostSweeps = 400;
  Plane logs = scene.intensity;
  for (float& value : logs.values) value = std::log(value);
  Grid<T> v(logs.width, logs.height);
  for (std::size_t i = 0; i < v.size(); ++i) v.values[i] = T(-0.5) * T(logs.values[i]);
  sweep_log_range(logs, Mask(logs.width, logs.height, 1), ray_grid(scene.camera), v, kMostSweeps,
                  1e-7);
  return v;
}

void compare_sweeping(Bench& bench) {
  bench.now("fast sweeping");
  constexpr double kRange_mm = 60;
  const NearScene scene = near_scene(0.5, 128);
  const Plane single = swept<float>(scene);
  const Grid<double> exact = swept<double>(scene);
  Kernel kernel{"shading: fast sweeping of 128², ranges kept", "single", "mm", kRange_mm};
  for (std::size_t i = 0; i < exact.size(); ++i)  // of logarithms: relative
    kernel.differences.push_back(kRange_mm * std::abs(single.values[i] - exact.values[i]));
  tell(bench, std::move(kernel));
}

template <class T>
T correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const T n = T(a.size());
  T mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) mean_a += T(a[i]) / n, mean_b += T(b[i]) / n;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const T x = T(a[i]) - mean_a, y = T(b[i]) - mean_b;
    aa += x * x, bb += y * y, ab += x * y;
  }
  return ab / std::sqrt(aa * bb);
}

// Of pictures that agree but for 2 % noise.
void compare_correlation(Bench& bench) {
  bench.now("normalised cross-correlation");
  constexpr std::size_t kPixels = 100'000, kPairs = 32;
  Kernel kernel{"registration: correlation of 100,000 pixels", "double", "of 1", 1};
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    RandomStream random(kPrecisionSeed, pair);
    std::vector<double> a(kPixels), b(kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) {
      a[i] = random.uniform(0.2, 0.8);
      b[i] = a[i] + 0.02 * random.normal();
    }
    kernel.differences.push_back(std::abs(correlation<float>(a, b) - correlation<double>(a, b)));
  }
  tell(bench, std::move(kernel));
}

}  // namespace

void run_precision_suite(Bench& bench) {
  const BoundOrgan organ;
  compare_quadrics(bench, organ);
  compare_shells(bench, organ);
  compare_depths(bench, organ);
  compare_landing(bench, organ);
  compare_deformation(bench);
  compare_sweeping(bench);
  compare_correlation(bench);
}

}  // namespace organbake
