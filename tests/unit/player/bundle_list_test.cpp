// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/bundle_list.h"

#include <gtest/gtest.h>

#include <fstream>

namespace organbake {
namespace {

namespace fs = std::filesystem;

TEST(BundleList, HasBundlesFirstAndNoHiddenFoldersOrFiles) {
  const fs::path folder = fs::path(testing::TempDir()) / "bundle_list";
  fs::remove_all(folder);
  for (const char* name : {"b", "a", "z_bundle", "y_bundle", ".hidden"})
    fs::create_directories(folder / name);
  for (const char* name : {"z_bundle/manifest.json", "y_bundle/manifest.json", "file"})
    std::ofstream(folder / name) << "{}";
  std::string listed;
  for (const ListedFolder& f : list_folders(folder)) listed += f.name + (f.is_bundle ? "! " : " ");
  EXPECT_EQ(listed, "y_bundle! z_bundle! a b ");
  EXPECT_TRUE(list_folders(folder / "nowhere").empty());
  fs::remove_all(folder);
}

}  // namespace
}  // namespace organbake
