// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/material_bundle.h"

#include "measuring/baker.h"

namespace organbake {

std::filesystem::path material_bundle(Bench& bench, const std::string& organ,
                                      const std::string& material) {
  const std::filesystem::path ct = bench.data("ct/abdomen/example_ct.nii.gz"),
                              mask = bench.data("ct/abdomen/example_seg.nii.gz");
  if (ct.empty() || mask.empty()) return {};
  const Baker baker(
      bench.scratch(), bench.context(),
      "schema: organbake/recipe/1\nname: organ\nisosurface: {smooth_mm: 1.5, largest: "
      "1}\ndecimate: {faces: auto}\nmechanics: {}\nplace: {count: 12}\ncapture: {}\n");
  const std::filesystem::path bundle = bench.scratch() / (organ + " of " + material);
  baker.bake(bundle, {"--set", "ct=" + ct.string(), "--set", "mask=" + mask.string(), "--set",
                      "label=" + organ, "--set", "capture.material=" + material});
  return bundle;
}

}  // namespace organbake
