// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/skin_image.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "support/meshes.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

TEST(SkinImage, SurvivesItsImage) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const SmoothSkin skin = flat_skin(proxy, 3);
  const SmoothSkin back = skin_from_image(skin_to_image(skin), "skin", proxy);
  EXPECT_EQ(back.steps, 3u);
  EXPECT_EQ(back.first, skin.first);
  EXPECT_EQ(back.carrier, skin.carrier);
  ASSERT_EQ(back.weight.size(), skin.weight.size());
  for (std::size_t k = 0; k < skin.weight.size(); ++k)
    EXPECT_NEAR(back.weight[k], skin.weight[k], 1e-6) << "weights are stored as floats";
}

TEST(SkinImage, OtherShapesAreRefused) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const ChannelImage image = skin_to_image(flat_skin(proxy, 3));
  EXPECT_THROW(skin_from_image(image, "skin", lumpy_mesh(40, 2)), BadDataError);
  SmoothSkin skin = flat_skin(proxy, 3);
  skin.weight[7] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(skin_from_image(skin_to_image(skin), "skin", proxy), BadDataError);
}

// An older player would bind the samples to the proxy: it has to refuse.
TEST(SkinImage, ABundleWithASkinHasAVersionOfItsOwn) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "skin_bundle";
  std::filesystem::remove_all(folder);
  Bundle bundle = small_bundle();
  write_bundle(folder, bundle);
  EXPECT_FALSE(BundleReader(folder).read_frame().skin);
  bundle.skin = flat_skin(bundle.proxy, 2);
  bundle.base.face_count = 16;
  bundle.base.height_mm.resize(16 * 6), bundle.base.seen_by.resize(16 * 6);
  bundle.base.color.resize(16 * 6, {0, 0, 0});
  write_bundle(folder, bundle);
  const Bundle back = BundleReader(folder).read_frame();
  EXPECT_NE(read_text_file(folder / "manifest.json").find("organbake/bundle/2"), std::string::npos);
  ASSERT_TRUE(back.skin);
  EXPECT_EQ(back.skin->carrier, bundle.skin->carrier);
  EXPECT_EQ(back.shell().at_rest().faces.size(), 4 * bundle.proxy.faces.size());
}

}  // namespace
}  // namespace organbake
