// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/isosurface/options.h"

namespace organbake {

Stage isosurface_stage() {
  return {
      .name = "isosurface",
      .version = 2,
      .summary = "turn a CT, or one label of a mask, into a closed surface",
      .inputs = {{"ct", InputKind::volume, "CT: NIfTI, MetaImage, NRRD, VTI or DICOM folder", true,
                  "mask"},
                 {"mask", InputKind::volume, "label mask; the surface of one label is taken",
                  false},
                 {"label_names", InputKind::file,
                  "names of the mask's labels: a text as ITK-SNAP or 3D Slicer writes it", false}},
      .outputs = {{"surface", "surface.ply"}},
      .make_options = make_options<IsosurfaceStageOptions>,
      .single_file = true};
}

}  // namespace organbake
