// SPDX-License-Identifier: GPL-3.0-or-later
// The phantom organ as surface, CT and cameras, all from one formula, so that each stage's truth is
// known without another stage. Voxels at the surface hold the share that is inside, by the
// formula's slope there, as a scanner's partial volumes do.
#include "organbake/phantom/phantom.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "formulas.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kInsideHu = 60, kOutsideHu = -1000;
// A voxel at the surface is cut into boxes of about this size, a sixth of the finest bump.
constexpr double kBoxMm = 0.8;
constexpr int kFewestBoxes = 2, kMostBoxes = 8;  // along each axis

class Scanner {
 public:
  Scanner(const OrganShape& shape, const Vector3d& spacing_mm)
      : shape_(shape), spacing_mm_(spacing_mm) {
    for (int axis = 0; axis < 3; ++axis) {
      const double boxes = std::ceil(spacing_mm[axis] / kBoxMm);
      boxes_[axis] = static_cast<int>(std::clamp<double>(boxes, kFewestBoxes, kMostBoxes));
      box_mm_[axis] = spacing_mm[axis] / boxes_[axis];
    }
    half_diagonal_mm_ = 0.5 * spacing_mm.norm();
  }

  // Share of the voxel's box that lies inside the organ.
  double inside_share(const Vector3d& center) const {
    const double distance = (center - shape_.center_mm()).norm();
    if (distance > shape_.outer_radius_mm() + half_diagonal_mm_) return 0;
    if (distance < shape_.inner_radius_mm() - half_diagonal_mm_) return 1;
    const double value = shape_.value(center);
    if (std::abs(value) > shape_.lipschitz() * half_diagonal_mm_) return value > 0 ? 1 : 0;
    return partial_volume(center);
  }

 private:
  double partial_volume(const Vector3d& center) const {
    const Vector3d first = center - 0.5 * (spacing_mm_ - box_mm_);
    double sum = 0;
    for (int k = 0; k < boxes_[2]; ++k)
      for (int j = 0; j < boxes_[1]; ++j)
        for (int i = 0; i < boxes_[0]; ++i)
          sum += box_share(first + box_mm_.cwiseProduct(Vector3d(i, j, k)));
    return sum / (boxes_[0] * boxes_[1] * boxes_[2]);
  }

  // Of a box that a nearly plane surface cuts: a ramp as wide as the box seen along the gradient.
  double box_share(const Vector3d& center) const {
    const OrganShape::Sample at = shape_.sample(center);
    const double width = at.gradient.cwiseAbs().dot(box_mm_);
    if (!(width > 0)) return at.value > 0 ? 1 : 0;
    return std::clamp(0.5 + at.value / width, 0.0, 1.0);
  }

  const OrganShape& shape_;
  Vector3d spacing_mm_, box_mm_;
  double half_diagonal_mm_;
  std::array<int, 3> boxes_;
};

std::int16_t to_hu(double inside_share, double noise_hu) {
  const double hu = kOutsideHu + inside_share * (kInsideHu - kOutsideHu) + noise_hu;
  return static_cast<std::int16_t>(std::lround(std::clamp(hu, -32768.0, 32767.0)));
}

constexpr double kMargin = 0.03;  // of the frame, free on every side

// A small camera's lens: 36° across; neither square pixels nor a centred axis, as in life, so that
// a swapped or forgotten intrinsic shows.
Intrinsics lens(int size) {
  Intrinsics lens;
  lens.width = lens.height = size;
  lens.fx = 1.540 * size;
  lens.fy = 1.537 * size;
  lens.cx = (0.5 + 0.013) * size;
  lens.cy = (0.5 - 0.009) * size;
  return lens;
}

// The least distance at which a point (camera axes, from the aim) stays inside the frame:
// |f a / (D + z) + c| within the margins, solved for D.
double distance_needed(const Intrinsics& lens, const Vector3d& from_aim) {
  const auto along = [&](double offset, double focal, double center, int size) {
    const double room = offset > 0 ? size * (1 - kMargin) - center : center - size * kMargin;
    return std::abs(offset) * focal / room;
  };
  return std::max(along(from_aim.x(), lens.fx, lens.cx, lens.width),
                  along(from_aim.y(), lens.fy, lens.cy, lens.height)) -
         from_aim.z();
}

// A golden-angle spiral from the front (anterior) to the back.
Vector3d spiral_direction(int index, int count) {
  const double y = -1 + (2.0 * index + 1) / count;
  const double angle = index * std::numbers::pi * (3 - std::sqrt(5.0)) + 0.4;
  const double r = std::sqrt(1 - y * y);
  return {r * std::cos(angle), y, r * std::sin(angle)};
}

// Off the world's origin by amounts that no voxel size divides, so that a lost origin shows.
Vector3d scan_center_mm() { return {12.6, -7.3, 31.1}; }

// The scan's grid: its size and spacing as asked for, LPS axes, its centre away from the world's.
Volume scan_organ(const OrganShape& shape, const OrganPhantomOptions& options,
                  const RunContext& context) {
  Volume ct;
  ct.size = options.ct_size;
  ct.spacing_mm = options.spacing_mm;
  const auto [nx, ny, nz] = ct.size;
  ct.origin_mm =
      scan_center_mm() - 0.5 * ct.spacing_mm.cwiseProduct(Vector3d(nx - 1, ny - 1, nz - 1));
  ct.voxels.resize(std::size_t(nx) * ny * nz);

  const Scanner scanner(shape, ct.spacing_mm);
  const auto scan_row = [&](std::size_t row) {
    RandomStream noise(options.seed, seed_items::kFirstScanRow + row);
    const double j = static_cast<double>(row % ct.size[1]), k = double(row / ct.size[1]);
    for (int i = 0; i < ct.size[0]; ++i) {
      const double share = scanner.inside_share(ct.world_from_index({double(i), j, k}));
      ct.voxels[row * ct.size[0] + i] = to_hu(share, options.noise_hu * noise.normal());
    }
  };
  constexpr std::size_t kRowsAtOnce = 16;
  parallel_pieces(std::size_t{0}, std::size_t(ny) * nz, kRowsAtOnce,
                  [&](std::size_t first, std::size_t last) {
                    context.throw_if_cancelled();
                    for (std::size_t row = first; row < last; ++row) scan_row(row);
                  });
  return ct;
}

// The formula's surface over an icosphere's directions, with its diffuse colours when `texture`.
TriangleMesh organ_surface(const Organ& organ, int subdivisions, bool colored,
                           const RunContext& context) {
  TriangleMesh mesh = make_icosphere(subdivisions);
  if (colored) mesh.colors.resize(mesh.vertices.size());
  const auto raise = [&](std::size_t v) {
    mesh.vertices[v] = organ.shape.surface_point(mesh.vertices[v]);
    if (!colored) return;
    const Eigen::Vector3d normal = -organ.shape.sample(mesh.vertices[v]).gradient.normalized();
    mesh.colors[v] = organ.diffuse(mesh.vertices[v], normal).cwiseMin(1.0).cast<float>();
  };
  constexpr std::size_t kVerticesAtOnce = 4096;
  parallel_pieces(std::size_t{0}, mesh.vertices.size(), kVerticesAtOnce,
                  [&](std::size_t first, std::size_t last) {
                    context.throw_if_cancelled();
                    for (std::size_t v = first; v < last; ++v) raise(v);
                  });
  return mesh;
}

}  // namespace

Eigen::Vector3d Organ::diffuse(const Eigen::Vector3d& world_mm,
                               const Eigen::Vector3d& normal) const {
  return texture.albedo(world_mm).cwiseProduct(studio_lighting().diffuse(normal));
}

namespace {

std::vector<PosedCamera> cameras_round(const TriangleMesh& surface, int count, int size) {
  const Vector3d aim = bounds(surface).center();
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < count; ++i) {
    PosedCamera camera;
    camera.name = "photo_" + std::to_string(i);
    camera.intrinsics = lens(size);
    const Vector3d outward = spiral_direction(i, count), up = Vector3d::UnitZ();
    const RigidTransform turned = look_at(aim + outward, aim, up);
    double distance = 0;
    for (const Vector3d& vertex : surface.vertices)
      distance =
          std::max(distance, distance_needed(camera.intrinsics, turned.rotation * (vertex - aim)));
    camera.camera_from_world = look_at(aim + distance * outward, aim, up);
    cameras.push_back(camera);
  }
  return cameras;
}

using Eigen::Vector3d;

const Vector3d kReferenceExtentMm{256, 256, 288};  // of the paper's scan: scale 1
const Vector3d kOrganOffsetMm{3.7, -4.4, 2.9};     // from the scan's centre, at scale 1
constexpr int kTracedSubdivisions = 6;  // for photographs: chords within 0.1 mm of the formula
constexpr int kFramedSubdivisions = 4;  // for framing the photographs

Organ make_organ(const OrganPhantomOptions& options) {
  const Vector3d size(options.ct_size[0], options.ct_size[1], options.ct_size[2]);
  const double scale =
      size.cwiseProduct(options.spacing_mm).cwiseQuotient(kReferenceExtentMm).minCoeff();
  const OrganShape shape(options.seed, scale, scan_center_mm() + scale * kOrganOffsetMm);
  return {shape, OrganTexture(options.seed, shape)};
}

}  // namespace

struct OrganPhantom::Impl {
  explicit Impl(const OrganPhantomOptions& options) : organ(make_organ(options)) {}

  Organ organ;
  // Only photographs need it.
  mutable std::once_flag traced_once;
  mutable std::unique_ptr<RayScene> traced;
};

OrganPhantom::OrganPhantom(const OrganPhantomOptions& options)
    : options_(options), impl_(std::make_shared<Impl>(options)) {}

double OrganPhantom::inside(const Vector3d& world_mm) const {
  return impl_->organ.shape.value(world_mm);
}

Vector3d OrganPhantom::normal(const Vector3d& world_mm) const {
  return -impl_->organ.shape.sample(world_mm).gradient.normalized();
}

Eigen::Vector3f OrganPhantom::albedo(const Vector3d& world_mm) const {
  return impl_->organ.texture.albedo(world_mm).cast<float>();
}

Volume OrganPhantom::scan(const RunContext& context) const {
  return scan_organ(impl_->organ.shape, options_, context);
}

TriangleMesh OrganPhantom::surface(int subdivisions, const RunContext& context) const {
  return organ_surface(impl_->organ, subdivisions, true, context);
}

std::vector<PosedCamera> OrganPhantom::photo_cameras() const {
  const TriangleMesh outline = organ_surface(impl_->organ, kFramedSubdivisions, false, {});
  return cameras_round(outline, options_.photo_count, options_.photo_size);
}

Rgb8Image OrganPhantom::photograph(const PosedCamera& camera, const RunContext& context) const {
  std::call_once(impl_->traced_once, [&] {
    impl_->traced = std::make_unique<RayScene>(
        organ_surface(impl_->organ, kTracedSubdivisions, false, context));
  });
  return photograph_organ(impl_->organ, *impl_->traced, camera, context);
}

}  // namespace organbake
