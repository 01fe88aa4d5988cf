// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/noise_ct.h"

#include <string>

#include "organbake/core/files.h"
#include "organbake/core/random.h"

namespace organbake {

Volume write_noise_ct(const std::filesystem::path& file) {
  Volume ct;
  ct.size = {512, 512, 300};  // of a small one the voxel round a region would be a large share
  ct.spacing_mm = {0.7, 0.7, 1};
  ct.voxels.resize(std::size_t(ct.size[0]) * ct.size[1] * ct.size[2]);
  RandomStream random(1);
  for (std::int16_t& voxel : ct.voxels) voxel = std::int16_t(random.below(1024));
  std::string text =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 512 512 300\n"
      "ElementSpacing = 0.7 0.7 1\nOffset = 0 0 0\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n";
  text.append(reinterpret_cast<const char*>(ct.voxels.data()),
              ct.voxels.size() * sizeof(std::int16_t));
  write_file_atomically(file, text);
  return ct;
}

Region middle_of(const Volume& ct, const Eigen::Vector3d& share) {
  const Eigen::Vector3d last(ct.size[0] - 1., ct.size[1] - 1., ct.size[2] - 1.);
  const auto corner = [&](double side) -> Eigen::Vector3d {
    return ct.world_from_index((0.5 * (Eigen::Vector3d::Ones() + side * share)).cwiseProduct(last));
  };
  return {corner(-1), corner(1)};
}

}  // namespace organbake
