// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "bench.h"
#include "peers/skinned_mesh.h"
#include "suites/baker.h"

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
  // Throws NoInputError when there is no organbake.
  explicit PlayerBundles(const Bench& bench);

  static constexpr int kCameras = 8;
  // Of the maps that are measured, px: quick runs take small ones.
  int map_size() const { return bench_.quick() ? 256 : 1024; }
  // Baked when first asked for. Throws Error with organbake's own words when it fails.
  std::filesystem::path folder(const BakeChoice& choice);
  // Their truth as an engine would hold it: 20 · 4^subdivisions faces under a skin of 1024².
  // Made when first asked for.
  const SkinnedMesh& skinned_mesh(int subdivisions);
  // A program that lies beside this one.
  std::filesystem::path program(const std::string& name) const;

 private:
  const Bench& bench_;
  Baker baker_;
  std::map<int, SkinnedMesh> skinned_;  // by subdivisions
};

}  // namespace organbake
