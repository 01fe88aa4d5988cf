// SPDX-License-Identifier: Apache-2.0
// Several organs in one frame, each pixel the nearest one's; and what was drawn last, so that a
// frame that stays is not drawn again.
#include "organbake/warp/warper.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "finishing/post_process.h"
#include "light/relit_skin.h"
#include "organbake/core/parallel.h"
#include "organbake/warp/organ_source.h"
#include "picture/spans.h"

namespace organbake {
std::optional<DrawReport> LastDrawing::unchanged(const View& view, const DrawOptions& options,
                                                 const Frame& frame) const {
  for (const Drawing& drawing : drawings_) {
    if (!drawing.is_in(frame) || !(view == drawing.view) || !(options == drawing.options)) continue;
    DrawReport report = drawing.report;
    report.unchanged = true;
    report.times = report.critical_path = {};
    return report;
  }
  return {};
}

bool LastDrawing::continues(const View& view, const DrawOptions& options,
                            const Frame& frame) const {
  const Drawing& last = drawings_.front();
  if (!last.is_in(frame) || !(view == last.view)) return false;
  DrawOptions same_tools = options;
  same_tools.solids = last.options.solids;
  same_tools.blood = last.options.blood, same_tools.smoke = last.options.smoke;
  return same_tools == last.options && frame.depth_mm.empty() == !options.needs_depth() &&
         frame.bound.empty() == !options.keep_bound;
}

void LastDrawing::remember(const View& view, const DrawOptions& options, const DrawReport& report,
                           bool still, Frame& frame) {
  // Serials differ between warpers, too: a frame may pass from one to another.
  static std::atomic<std::uint64_t> next_serial{0};
  frame.serial = first_serial_ + ++next_serial;
  drawings_.back() = still ? drawings_.front() : Drawing();
  drawings_.front() = {view, options, report, frame.serial};
}

// The pictures of several organs by their depths (z-buffer compositing, Duff 1985, "Compositing 3-D
// rendered images"): each warper keeps its own samples and its own last picture, so an organ that
// did not move is not drawn again.
namespace {

// The pixels of one organ's picture from `begin` to `end` that lie before those of the frame.
void take_nearer(const Frame& layer, std::uint8_t organ, std::size_t begin, std::size_t end,
                 Frame& frame, std::vector<float>& depth_mm) {
  const bool bound = !frame.bound.empty() && !layer.bound.empty();
  for (std::size_t i = begin; i < end; ++i) {
    if (!(layer.depth_mm[i] < depth_mm[i])) continue;
    depth_mm[i] = layer.depth_mm[i];
    frame.cover[i] = layer.cover[i];
    std::copy_n(layer.color.pixels.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                frame.color.pixels.begin() + static_cast<std::ptrdiff_t>(3 * i));
    if (bound) frame.bound[i] = layer.bound[i], frame.organ[i] = organ;
  }
}

// The sums of what was drawn, the largest texels; the cameras are the first organ's.
DrawReport joined_report(const std::vector<DrawReport>& reports, bool unchanged) {
  DrawReport sum = reports.front();
  sum.unchanged = unchanged;
  for (std::size_t r = 1; r < reports.size(); ++r) {
    const DrawReport& more = reports[r];
    sum.tiles_drawn += more.tiles_drawn;
    sum.tiles_kept += more.tiles_kept;
    sum.samples_drawn += more.samples_drawn;
    sum.base_triangles += more.base_triangles;
    sum.sample_pixels += more.sample_pixels;
    sum.base_pixels += more.base_pixels;
    sum.filled_pixels += more.filled_pixels;
    sum.texel_mm = std::max(sum.texel_mm, more.texel_mm);
    sum.times += more.times;
    sum.critical_path += more.critical_path;
  }
  return sum;
}

}  // namespace

double metered_mm(const std::vector<JointDrawing::Organ>& organs, const View& view,
                  const DrawOptions& options) {
  std::optional<ScopeLight> scope;
  std::vector<const TriangleMesh*> proxies;
  for (const JointDrawing::Organ& organ : organs) {
    if (!scope && organ.lighting) scope = organ.lighting->scope;
    proxies.push_back(&organ.proxy_at_rest);
  }
  return metered_mm(scope.value_or(ScopeLight()), proxies, view, options);
}

void JointDrawing::join(const DrawOptions& options, float deeper_mm, Frame& frame) const {
  const Frame& first = pictures_.front();
  frame.color = first.color;
  frame.cover = first.cover;
  frame.bound = options.keep_bound ? first.bound : std::vector<BoundPixel>{};
  frame.bound_as_drawn = options.bind_as_drawn;
  frame.organ.assign(frame.bound.size(), 0);
  std::vector<float> depth_mm = first.depth_mm;
  constexpr std::size_t kGrain = 1 << 14;
  parallel_pieces(std::size_t{0}, depth_mm.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t o = 1; o < pictures_.size(); ++o)
      take_nearer(pictures_[o], static_cast<std::uint8_t>(o), begin, end, frame, depth_mm);
  });
  if (options.smooth_outline) {
    const SkinDepth depth = SkinDepth::of(depth_mm, frame.color.width, deeper_mm);
    smooth_outlines(frame, &depth, deeper_mm);
  }
  frame.depth_mm = options.keep_depth ? std::move(depth_mm) : std::vector<float>{};
}

DrawReport JointDrawing::draw(const std::vector<Organ>& organs, const View& view,
                              const DrawOptions& options, Frame& frame) {
  DrawOptions own = options;
  if (organs.size() == 1) {
    const auto& [warper, positions_mm, proxy, lighting] = organs.front();
    if (!warper.can_relight()) own.light = DrawnLight::baked;
    return warper.draw(positions_mm, view, own, frame);
  }
  own.keep_depth = true;
  own.smooth_outline = false;  // theirs together is
  own.scope_reference_mm = metered_mm(organs, view, options);
  bool unchanged = serial_ != 0 && frame.serial == serial_;
  std::vector<DrawReport> reports;
  pictures_.resize(organs.size());
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const auto& [warper, positions_mm, proxy, lighting] = organs[o];
    own.light = warper.can_relight() ? options.light : DrawnLight::baked;
    reports.push_back(warper.draw(positions_mm, view, own, pictures_[o]));
    unchanged = unchanged && reports.back().unchanged;
  }
  // Of a frame asked for with less, what it lacks now would be missing.
  unchanged = unchanged && frame.depth_mm.empty() == !options.keep_depth &&
              frame.bound.empty() == !options.keep_bound;
  const DrawReport joined = joined_report(reports, unchanged);
  if (unchanged) return joined;
  frame.serial = 0;
  join(options, kStepTexels * joined.texel_mm, frame);
  for (const Frame& picture : pictures_) serial_ = std::max(serial_, picture.serial);
  frame.serial = serial_;
  return joined;
}

}  // namespace organbake
