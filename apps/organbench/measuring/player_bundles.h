// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "measuring/baker.h"
#include "peers/skinned_mesh.h"

namespace organbake {

struct BakeChoice {
  int faces = 80;                 // of the proxy
  std::string method = "fitted";  // of the decimation
  int map_size = 1024;            // px
  bool elements = false;          // for the solver fem
  bool skin = true;               // smooth, over the proxy; else the proxy's own prisms
};

// Bundles of the phantom organ, baked as users bake them.
class PlayerBundles {
 public:
  // In `folder`; small: of few voxels and texels. Throws NoInputError when there is no organbake.
  PlayerBundles(std::filesystem::path folder, RunContext context, bool small);

  static constexpr int kCameras = 8;
  // Of the maps that are measured, px.
  int map_size() const { return small_ ? 256 : 1024; }
  // Baked when first asked for. Throws Error with organbake's own words when it fails.
  std::filesystem::path folder(const BakeChoice& choice);
  // Their truth as an engine would hold it: 20 · 4^subdivisions faces under a skin of 1024².
  // Made when first asked for.
  const SkinnedMesh& skinned_mesh(int subdivisions);

 private:
  std::filesystem::path folder_;
  RunContext context_;
  bool small_;
  Baker baker_;
  std::map<int, SkinnedMesh> skinned_;  // by subdivisions
};

}  // namespace organbake
