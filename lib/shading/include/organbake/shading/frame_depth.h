// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "organbake/shading/depth_maps.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/shading/shape_from_shading.h"

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
  // How much farther the rim of the view is than its middle, as the standard deviation of ln z that
  // its part by r² (of normalised image coordinates) makes; below 0 where the middle is farther. A
  // beam and a vignette darken the rim and feign the former; nothing but depth, or an albedo that
  // happens to be dark in the middle alone, makes the latter: a tube's lumen, a cavity's ground.
  double bowl = 0;
  // Standard deviation of ln z over the picture, its tilt and bowl taken out.
  double rest_sd = 0, tilt_sd = 0;
};

// Over cells of a fiftieth of the frame's longer side that show diffuse tissue; all but the
// unexplained brightness is 0 where there are too few.
[[nodiscard]] ReliefEvidence relief_evidence(const PreparedFrame& frame,
                                             const RangeEstimate& estimate);

// How much is kept of the parts of a relief (of ln z, over the picture), each 0…1.
struct ReliefShare {
  double tilt = 0;  // of the whole view, right and left, up and down
  double bowl = 0;  // of the whole view, from its middle to its rim
  double rest = 0;  // of what is left without both
};

// Of the logit of a share: constant, and by ln of the unexplained brightness, by the tilt's share,
// by the correlation with hue and by the bowl.
using ReliefShareTerms = std::array<double, 5>;
struct ReliefShareModel {
  ReliefShareTerms tilt, bowl, rest;
};
extern const ReliefShareModel kReliefShareModel;

// The shares of the relief that are safe to keep: chosen so that the error of depth is as small as
// may be without being larger than a plane's. All where a smooth shape explains the picture.
[[nodiscard]] ReliefShare relief_share(const ReliefEvidence& evidence,
                                       const ReliefShareModel& model = kReliefShareModel);

// The mean error of the depth that the shares leave, once it has the right scale, as a share.
[[nodiscard]] double expected_error(const ReliefEvidence& evidence);

// Draws ln r to the plane across the axis that lies at the tissue's median depth: all of it for
// shares of 0, nothing for 1. Tilt and bowl are the least-squares fit of x, y and x² + y² to ln z
// over the tissue.
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
  // Of the shaded depth, once it has the right scale: its mean error, a share, as the evidence has
  // it.
  double expected_error = 0;
  ReliefShare kept = {};  // of a shaded frame's relief
};

// Ok means that the depth is expected to be right within a tenth. A small misfit proves no shape,
// but what no smooth surface explains is texture, several tissues or another light, and then the
// rest, which one does explain, is as likely the same; and a deep relief errs by more than a flat
// one. What is kept of the relief is relief_share() of the frame, evened
// with what was kept of `previous`, the frame before it where that looks alike (else null): shares
// follow a clip without flicker, and a depth that was taken over keeps its own.
[[nodiscard]] DepthQuality judge_depth(const PreparedFrame& frame, const RangeEstimate& estimate,
                                       const DepthQuality* previous = nullptr);

enum class ShadingModel { laparoscope, tsai_shah };

struct ShadingOptions {
  ShadingModel model = ShadingModel::laparoscope;
  LaparoscopeOptions laparoscope{.texture = 0.03};
  std::optional<DistantLight> light;  // of Tsai–Shah; nothing = estimated from each cold frame
  // What makes the laparoscope's depth metric, first come: the median range of the tissue, or the
  // albedo (intensity = albedo · cos θ / r², r in mm). 0 = unknown: depth is relative, median 1.
  double range_mm = 0;
  double albedo = 0;
  // The share of the laparoscope's relief that is kept, 0…1; nothing = as much as the frame's own
  // evidence allows.
  std::optional<double> relief;

  void check() const;  // throws UsageError
};

// Depth of one frame with all that is told about it.
struct FrameDepth {
  Plane depth;  // planar z; mm or relative; +inf where there is no tissue
  std::vector<Eigen::Vector3f> normals;
  Plane confidence;
  bool metric = false;
  bool warm = false;
  double residual = 0;  // of the image, which proves nothing about the depth
  DepthQuality quality;
  DistantLight light;  // used, of Tsai–Shah

  // What a following frame starts from.
  RangeEstimate range;
  Grid<double> tsai_shah_depth;
};

// Reads a frame as shading. `previous` = the depth of a frame that looks alike, or null.
FrameDepth shade_frame(const PreparedFrame& frame, const ShadingOptions& options,
                       const FrameDepth* previous = nullptr);

}  // namespace organbake
