// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

namespace organbake {

void bind(OptionList& list, ExportOptions& o) {
  list.add("format", &o.format,
           {.help = "gltf: proxy and cameras in metres; colmap, transforms: cameras with their "
                    "pictures; obj: the surface, as fine as the base layer, with a texture"},
           {{"gltf", ExportFormat::gltf},
            {"colmap", ExportFormat::colmap},
            {"transforms", ExportFormat::transforms},
            {"obj", ExportFormat::obj}});
}

void bind(OptionList& list, BundleOptions& o) {
  list.add("surface", &o.surface,
           {.help = "keep the coloured surface in the bundle, to compare frames with"});
}

}  // namespace organbake
