// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "organbake/shading/depth_verdict.h"
#include "organbake/shading/distant.h"
#include "organbake/shading/laparoscope.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/shading/ray_grid.h"
#include "organbake/shading/tsai_shah.h"

namespace organbake {

enum class ShadingModel { laparoscope, tsai_shah, distant };

struct ShadingOptions {
  ShadingModel model = ShadingModel::laparoscope;
  LaparoscopeOptions laparoscope{.texture = 0.03};
  std::optional<DistantLight>
      light;            // of a distant model; nothing = estimated from each cold frame
  int iterations = 20;  // of Tsai–Shah
  // What makes the laparoscope's depth metric, first come: the median range of the tissue, or the
  // albedo (intensity = albedo · cos θ / r², r in mm). 0 = unknown: depth is relative, median 1.
  double range_mm = 0;
  double albedo = 0;

  void check() const;  // throws UsageError
};

// Depth of one frame with all that is told about it.
struct FrameDepth {
  Plane depth;  // planar z; mm or relative; +inf where there is no tissue
  std::vector<Eigen::Vector3f> normals;
  Plane confidence;
  bool metric = false;
  bool warm = false;
  int sweeps = 0, refinements = 0;
  double residual = 0;  // of the image, which proves nothing about the depth
  double noise = 0;
  DepthQuality quality;
  std::string branch;  // of a distant model
  bool ambiguous = false;
  DistantLight light;  // used, of a distant model

  // What a following frame starts from.
  RangeEstimate range;
  Grid<double> tsai_shah_depth;
  Plane distant_depth;
};

// Reads a frame as shading. `previous` = the depth of a frame that looks alike, or null.
FrameDepth shade_frame(const PreparedFrame& frame, const ShadingOptions& options,
                       const FrameDepth* previous = nullptr);

}  // namespace organbake
