// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/isosurface/isosurface.h"

#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "promises.h"
#include "support/files.h"

namespace organbake {
namespace {

// What the Image Biomarker Standardisation Initiative agreed on for a figure of its digital
// phantom.
struct Consensus {
  const char* what;
  const char* unit;
  double value, tolerance;
};

void add_beside(const Consensus& consensus, double ours) {
  const std::string what = "IBSI's digital phantom, consensus " + to_text(consensus.value) + " ± " +
                           to_text(consensus.tolerance) + ": " + consensus.what;
  const double most = consensus.value + consensus.tolerance;
  const double least = consensus.value - consensus.tolerance;
  expect({what + ", at most", consensus.unit, ours, most, Figure::Goal::at_most});
  expect({what + ", at least", consensus.unit, ours, least, Figure::Goal::at_least});
}

// Zwanenburg et al. 2020, The Image Biomarker Standardization Initiative, Radiology 295(2): the
// surface by marching cubes at one half, and what the voxels enclose.
TEST(Isosurface, OfIbsisPhantomIsWhatWasAgreedOn) {
  REQUIRE_SHARED_DATA("ibsi_digital_phantom/mask.nii.gz");
  const Volume mask =
      read_volume(shared_data("ibsi_digital_phantom/mask.nii.gz"), {.label = "1", .is_mask = true});
  add_beside({"volume of the voxels, by default", "mm³", 592, 4},
             signed_volume(extract_label_surface(mask, {}).mesh));
  IsosurfaceOptions textbook;
  textbook.smooth_mm = 0;
  textbook.largest = 0;
  textbook.keep_volume = false;
  const TriangleMesh mesh = extract_label_surface(mask, textbook).mesh;
  add_beside({"volume of the mesh", "mm³", 556, 4}, signed_volume(mesh));
  add_beside({"area of the mesh", "mm²", 388, 3}, surface_area(mesh));
}

}  // namespace
}  // namespace organbake
