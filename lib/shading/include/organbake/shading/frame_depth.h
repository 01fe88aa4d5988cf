// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "organbake/shading/depth_maps.h"
#include "organbake/shading/distant.h"
#include "organbake/shading/laparoscope.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {

// What a frame itself tells of how far the relief that was read from its shading is to be believed.
struct ReliefEvidence {
  // Share of the brightness, at organ scale, that no smooth shape explains (RangeEstimate).
  double unexplained = 0;
  // Share 0…1 of the relief's variance (of ln z, over the picture) that is a tilt of the whole
  // view. A lamp's beam or a vignette that was not taken into account bends a picture into a bowl,
  // but cannot tilt it.
  double tilt_share = 0;
  // Correlation −1…1 of ln z with the hue (ln of green by red). Where pale tissue is read as near
  // and dark as far, several tissues were taken for a shape.
  double hue_correlation = 0;
};

// Over cells of a fiftieth of the frame's longer side that show diffuse tissue; all but the
// unexplained brightness is 0 where there are too few.
[[nodiscard]] ReliefEvidence relief_evidence(const PreparedFrame& frame,
                                             const RangeEstimate& estimate);

// How much is kept of the two parts of a relief (of ln z, over the picture), each 0…1.
struct ReliefShare {
  double tilt = 0;  // of the whole view, right and left, up and down
  double rest = 0;  // of what is left without it
};

// Of the logit of a share: constant, and by ln of the unexplained brightness, by the tilt's share
// and by the correlation with hue.
using ReliefShareTerms = std::array<double, 4>;
struct ReliefShareModel {
  ReliefShareTerms tilt, rest;
};
extern const ReliefShareModel kReliefShareModel;

// The shares of the relief that are safe to keep: chosen so that the error of depth is as small as
// may be without being larger than a plane's. All where a smooth shape explains the picture.
[[nodiscard]] ReliefShare relief_share(const ReliefEvidence& evidence,
                                       const ReliefShareModel& model = kReliefShareModel);

// Draws ln r to the plane across the axis that lies at the tissue's median depth: all of it for
// shares of 0, nothing for 1. The tilt is the least-squares plane of ln z over the tissue.
void keep_relief(const RayGrid& rays, const Mask& tissue, const ReliefShare& share,
                 Plane& log_range);

enum class DepthVerdict { ok, doubtful, failed };
const char* name_of(DepthVerdict verdict);

// Whether a frame supports the shape that was read from it.
struct DepthQuality {
  DepthVerdict verdict = DepthVerdict::failed;
  std::string reason;  // empty when ok
  double support = 0;  // 0…1: the share of the relief's variance, or of the view, that is kept
  double unexplained = 0;  // share of the brightness, at organ scale, that no shape explains
  ReliefShare kept = {};   // of a shaded frame's relief
};

// A small misfit proves no shape, but a large one disproves the model: brightness that no smooth
// surface explains is texture, several tissues or another light, and then the rest, which one does
// explain, is as likely the same. What is kept of the relief is relief_share() of the frame, evened
// with what was kept of `previous`, the frame before it where that looks alike (else null): shares
// follow a clip without flicker, and a depth that was taken over keeps its own.
[[nodiscard]] DepthQuality judge_depth(const PreparedFrame& frame, const RangeEstimate& estimate,
                                       const DepthQuality* previous = nullptr);

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
