// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/isosurface/isosurface.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/options.h"
#include "stages/shared/volume_options.h"

namespace organbake {

struct IsosurfaceStageOptions {
  IsosurfaceOptions surface;
  std::string label = "1";  // number, name, or several of them
  bool each_label = false;  // a file for every label of the mask, in a folder
  ReadStageOptions reading;
};

inline void bind(OptionList& list, IsosurfaceStageOptions& options) {
  IsosurfaceOptions& o = options.surface;
  list.add("iso", &o.iso_hu,
           {.help = "level of the surface when no mask is given; the organ lies above it; auto = "
                    "half-way between the histogram's two peaks",
            .unit = "HU, or the volume's own unit"})
      .add("label", &options.label,
           {.help = "the organ in the mask: its label's number or name; several, parted by commas, "
                    "become one organ",
            .range = {1, kMostLabel},
            .number_too = true})
      .add("each_label", &options.each_label,
           {.help = "a surface for every label of the mask, named for it, in the folder -o DIR"})
      .add("largest", &o.largest,
           {.help =
                "pieces kept, by area; 0 = all. A label's cavities stay in their piece, a CT's are "
                "filled unless all is kept",
            .range = {0, 1000000}})
      .add("min_size_mm", &o.min_size_mm,
           {.help = "components whose box is nowhere longer are dropped", .range = {0, 10000}})
      .add("refine", &o.refine,
           {.help = "place a CT's surface by all voxels across the edge, not by two of them: right "
                    "inside thick slices"})
      .add("smooth_mm", &o.smooth_mm,
           {.help = "Gaussian on a mask before its surface is taken; 0 leaves voxel stairs",
            .range = {0, 50}})
      .add("keep_volume", &o.keep_volume,
           {.help =
                "a mask's surface encloses the volume of its voxels; off: the level is one half, "
                "as textbooks have it, and corners are lost"})
      .add("cap", &o.cap,
           {.help =
                "where the volume, or a mask that ends flat, cuts the organ its surface is closed "
                "flat, or round by a dome of at most a twentieth of its volume that no scan has "
                "shown, or left open at the volume's end; true is flat, false is open"},
           {{"flat", SurfaceCap::flat},
            {"round", SurfaceCap::round},
            {"open", SurfaceCap::open},
            {"true", SurfaceCap::flat},
            {"false", SurfaceCap::open}})
      .retire("method", "the surface is marching cubes', found by flying edges")
      .retire("taubin", "smooth_mm smooths a mask, refine places a CT's surface by more voxels");
  bind(list, options.reading);
}

inline Stage isosurface_stage() {
  return {
      .name = "isosurface",
      .summary = "turn a CT, or one label of a mask, into a closed surface",
      .inputs =
          {{"ct", InputKind::volume, "CT: NIfTI, MetaImage, NRRD, VTI or DICOM folder", true,
            "mask"},
           {"mask", InputKind::volume,
            "label mask, or a folder of masks named for their labels; the surface of one label "
            "is taken",
            false},
           {"label_names", InputKind::file,
            "names of the mask's labels: a text as ITK-SNAP or 3D Slicer writes it, or nnU-Net's "
            "dataset.json",
            false}},
      .outputs = {{"surface", "surface.ply"}},
      .make_options = make_options<IsosurfaceStageOptions>,
      .single_file = true};
}

}  // namespace organbake
