// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/phantom.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "organ.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "photograph_organ.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

const Vector3d kReferenceExtentMm{256, 256, 288};  // of the paper's scan: scale 1
const Vector3d kOrganOffsetMm{3.7, -4.4, 2.9};     // from the scan's centre, at scale 1
constexpr int kTracedSubdivisions = 6;  // for photographs: chords within 0.1 mm of the formula
constexpr int kFramedSubdivisions = 4;  // for framing the photographs

Organ make_organ(const OrganPhantomOptions& options) {
  options.check();
  const Vector3d size(options.ct_size[0], options.ct_size[1], options.ct_size[2]);
  const double scale =
      size.cwiseProduct(options.spacing_mm).cwiseQuotient(kReferenceExtentMm).minCoeff();
  const OrganShape shape(options.seed, scale, scan_center_mm() + scale * kOrganOffsetMm);
  return {shape, OrganTexture(options.seed, shape)};
}

}  // namespace

void OrganPhantomOptions::check() const {
  for (int axis = 0; axis < 3; ++axis) {
    static const std::array<const char*, 3> kAxes = {" along x", " along y", " along z"};
    const std::string along = kAxes[axis];
    require(ct_size[axis] >= 8 && ct_size[axis] <= 2048, "ct_size" + along, ct_size[axis],
            "take 8…2048 voxels");
    require(spacing_mm[axis] >= 0.05 && spacing_mm[axis] <= 50, "spacing_mm" + along,
            spacing_mm[axis], "take 0.05…50 mm");
  }
  require(noise_hu >= 0 && noise_hu <= 500, "noise_hu", noise_hu,
          "take 0…500, well below the organ's contrast of 1060 HU");
  require(photo_count >= 0 && photo_count <= 1000, "photo_count", photo_count, "take 0…1000");
  require(photo_size >= 16 && photo_size <= 16384, "photo_size", photo_size,
          "take 16…16384 pixels");
}

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
