// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

#include "organ.h"
#include "organbake/geometry/icosphere.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Measured image errors depend on the organ, so its formula is frozen: whoever changes one of these
// numbers has made another phantom, and every figure that was measured on it is void.
struct Frozen {
  Vector3d world_mm;
  double inside_mm;
  Vector3d albedo;
};
const Frozen kFrozen[] = {
    {{0, 0, 0}, 13.49806411438, {0.24011793660, 0.04500873473, 0.02944289081}},
    {{60, -20, 40}, 42.75385832589, {0.21170917038, 0.03982523724, 0.02555163473}},
    {{-40, 0, 30}, 15.68131595563, {0.26381091753, 0.06057283689, 0.03994068549}},
    {{16, -60, 20}, -1.62043931662, {0.17965770520, 0.03683413255, 0.02459901008}},
    {{16, 30, 60}, 0.40418373436, {0.22387125800, 0.04752608671, 0.03090621807}},
    {{-200, 500, 10}, -499.24780539507, {0.13826406508, 0.02633676912, 0.01930253264}},
    {{6.25, 34.5, 17.75}, 0.14057451652, {0.13117516001, 0.01934858497, 0.02303997627}},
    {{-7.5, -18.25, 94}, -0.00340124251, {0.57176923231, 0.35842672505, 0.14598687025}},
    {{14.5, -27, -15.25}, -0.00380992648, {0.19836248987, 0.26081805656, 0.07398998560}},
};
constexpr double kFrozenTolerance = 1e-9;  // libm and fused multiply-adds differ in the last digits

TEST(OrganFormula, IsFrozen) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  const OrganShape shape(1, 1, Vector3d(16.3, -11.7, 34.0));
  const OrganTexture texture(1, shape);
  for (const Frozen& frozen : kFrozen) {
    EXPECT_NEAR(phantom.inside(frozen.world_mm), frozen.inside_mm, kFrozenTolerance);
    EXPECT_NEAR(shape.value(frozen.world_mm), frozen.inside_mm, kFrozenTolerance);
    const Vector3d albedo = texture.albedo(frozen.world_mm);
    EXPECT_LT((albedo - frozen.albedo).cwiseAbs().maxCoeff(), kFrozenTolerance)
        << albedo.transpose();
    EXPECT_EQ(phantom.albedo(frozen.world_mm), albedo.cast<float>());
  }
}

TEST(OrganFormula, AlbedoIsAColourEverywhere) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  for (const Vector3d& vertex : phantom.surface(4).vertices) {
    const Eigen::Vector3f albedo = phantom.albedo(vertex);
    EXPECT_TRUE(albedo.allFinite());
    EXPECT_GE(albedo.minCoeff(), 0);
    EXPECT_LE(albedo.maxCoeff(), 1);
  }
}

// Detail narrower than a few texels of 0.3 mm would alias whatever the baker does.
TEST(OrganFormula, TextureIsSmoothAtATexel) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  constexpr double kTexelMm = 0.3;
  double sum2 = 0, sum_bend2 = 0;
  int count = 0;
  for (const Vector3d& vertex : phantom.surface(5).vertices) {
    const Vector3d along = kTexelMm * phantom.normal(vertex).unitOrthogonal();
    const auto at = [&](double texels) -> Eigen::Vector3f {
      return phantom.albedo(vertex + texels * along);
    };
    sum2 += (at(1) - at(-1)).squaredNorm();
    sum_bend2 += (at(-1) - 2 * at(0) + at(1)).squaredNorm();
    ++count;
  }
  // A wave of length L has bend/step = tan(π · 0.3 / L): 0.3 for L = 3.2 mm, two 1.6 mm features.
  EXPECT_LT(std::sqrt(sum_bend2 / sum2), 0.3);
  EXPECT_GT(std::sqrt(sum2 / count), 0.01) << "there must be texture to align and to blur";
}

// One patch of bile green on the organ's right, front and lower side: a mirrored picture shows it
// on the wrong side.
TEST(OrganFormula, TheGreenMarkIsWhereItBelongs) {
  const OrganPhantom phantom(OrganPhantomOptions{});
  const TriangleMesh surface = phantom.surface(5);
  const Vector3d center = bounds(surface).center();
  Vector3d green_sum = Vector3d::Zero();
  int green = 0;
  for (const Vector3d& vertex : surface.vertices) {
    const Eigen::Vector3f albedo = phantom.albedo(vertex);
    if (albedo.y() < 1.15f * albedo.x()) continue;
    green_sum += vertex - center;
    ++green;
  }
  const double share = double(green) / static_cast<double>(surface.vertices.size());
  EXPECT_GT(share, 0.005);
  EXPECT_LT(share, 0.05);
  const Vector3d mean = green_sum / green;
  EXPECT_LT(mean.x(), -10);  // right
  EXPECT_LT(mean.y(), -10);  // anterior
  EXPECT_LT(mean.z(), -20);  // inferior
}

}  // namespace
}  // namespace organbake
