// SPDX-License-Identifier: GPL-3.0-or-later
#include "draft_proxy.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

TEST(DraftProxy, IsAManifoldNearTheSurface) {
  const TriangleMesh mesh = lumpy_mesh(50, 5);  // 20,480 faces, more than the clusters leave
  const DecimateResult draft = decimate(mesh, {.method = DecimateMethod::draft, .faces = 80});
  EXPECT_LE(draft.proxy.faces.size(), 80u);
  EXPECT_GE(draft.proxy.faces.size(), 78u);
  EXPECT_TRUE(draft.closed_manifold);
  EXPECT_EQ(draft.genus, 0);
  EXPECT_EQ(draft.worst_thickness_mm, 0);  // not asked for
  // What is promised: 0.7 % of the diagonal.
  EXPECT_LT(draft.rms_mm, 0.007 * bounds(mesh).diagonal());
}

// Clusters would make one plate of two: the collapses begin with the surface.
TEST(DraftProxy, KeepsWhatIsThinnerThanItsClusters) {
  const TriangleMesh plate = grid_box({200, 200, 0.5}, 60);  // 43,200 faces
  const TriangleMesh proxy = draft_proxy(plate, 100);
  EXPECT_TRUE(analyse_topology(proxy).closed_manifold());
  EXPECT_NEAR(signed_volume(proxy), signed_volume(plate), 0.05 * signed_volume(plate));
}

TEST(DraftProxy, CannotKeepAnErrorBudget) {
  EXPECT_THROW(DecimateOptions({.method = DecimateMethod::draft, .max_error_mm = 1}).check(),
               UsageError);
}

}  // namespace
}  // namespace organbake
