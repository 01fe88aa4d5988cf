// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "bundle/bundle.h"
#include "geometry/shell_map.h"
#include "geometry/view_manifold.h"
#include "warp/drawn_light.h"
#include "warp/frame.h"
#include "warp/solids.h"
#include "warp/view.h"

namespace organbake {

enum class WarpMethod : std::uint8_t {
  bound,  // forward splats of samples bound to the proxy's shell
  paper,  // the paper's screen-space chain (paper_warp.h), the baseline
};

struct DrawOptions {
  WarpMethod method = WarpMethod::bound;                  // Player::draw() chooses by it
  std::array<std::uint8_t, 3> background = {22, 23, 26};  // sRGB
  bool base_layer = true;  // draw the base layer where no active camera sees the skin
  bool fill_holes = true;
  // Blend skin with the background by the share of each pixel that it covers (outline.h); not by
  // the paper's own warp.
  bool smooth_outline = true;
  // The paper's own warp always draws what was baked.
  DrawnLight light = DrawnLight::baked;
  // The range of full exposure of the light at the scope, mm; 0: as the bundle's ScopeLight says.
  // For several organs, which are lit by one.
  double scope_reference_mm = 0;
  bool keep_depth = false;  // also fill Frame::depth_mm; implied by solids
  bool keep_shown = false;  // also fill Frame::shown, for pixels of Cover::samples
  bool keep_bound = false;  // also fill Frame::bound
  bool measure = false;     // fill DrawReport's times
  std::vector<Solid> solids;

  bool operator==(const DrawOptions& other) const = default;
};

// Milliseconds of work by phase, summed over threads; zero unless measured.
struct DrawTimes {
  double transform = 0;  // faces and chunks placed, culled and listed by tile
  double splat = 0, base = 0, resolve = 0, fill = 0;
  double tools = 0;  // instruments drawn into the picture

  DrawTimes& operator+=(const DrawTimes& more) {
    transform += more.transform, splat += more.splat, base += more.base;
    resolve += more.resolve, fill += more.fill, tools += more.tools;
    return *this;
  }
};

struct DrawReport {
  bool unchanged = false;  // same view, positions and options: the frame was left alone
  // Tiles of which anything was drawn, and those that stayed since nothing moved there.
  int tiles_drawn = 0, tiles_kept = 0;
  ViewWeights weights;                  // the cameras in use
  float texel_mm = 0;                   // mean size of their texels on the surface
  std::size_t samples_drawn = 0;        // of chunks that were drawn
  std::size_t samples_facing_away = 0;  // skipped in whole chunks
  std::size_t samples_outside_view = 0;
  // Per active camera and face: skipped in whole, by what skipped its last chunk.
  std::size_t faces_drawn = 0, faces_facing_away = 0, faces_outside_view = 0;
  std::size_t base_triangles = 0;  // drawn
  std::size_t sample_pixels = 0, base_pixels = 0;
  std::size_t holes_before = 0, holes_after = 0;
  double largest_stretch_px = 0;  // widest splat, pixels per texel
  DrawTimes times;
};

// Draws a bundle's organ, deformed or not, from any view by forward-warping the samples of the
// three cameras that the viewing projection manifold names (the paper, 2.2). The same bytes for
// any number of threads. One draw() at a time.
class Warper {
 public:
  // Binds every sample of the bundle's maps, which are not needed afterwards. Throws BadDataError
  // when they or the base layer don't fit the cameras or the proxy.
  explicit Warper(const Bundle& bundle);
  // Takes everything but the maps from the bundle, and asks for a camera's maps when a view first
  // needs them. `read` may be called from any thread, for several cameras at once.
  using ReadMaps = std::function<CameraMaps(std::size_t camera)>;
  Warper(const Bundle& bundle, ReadMaps read);
  ~Warper();
  Warper(Warper&&) noexcept;

  // positions: the proxy's vertices, world mm. Throws UsageError for a bad view or options, such as
  // a light other than the baked one for a bundle that does not know its own,
  // BadDataError for a wrong number of positions or one that is not finite, and what reading and
  // binding a camera's maps throws.
  DrawReport draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                  const DrawOptions& options, Frame& frame);

  // Whether the bundle knows its light, and has the base layer that it falls on.
  bool can_relight() const;
  // The light that it is meant to be seen in: at the scope when its lighting has that, else the
  // world's, else what was baked.
  DrawnLight usual_light() const;

  // The shell as it was last drawn, world mm, by face.
  const std::vector<ShellMatrix>& shell_matrices() const;

  // Binds all cameras now, or from a thread of its own while frames are drawn: turning the view
  // then never waits. Frames are the same either way.
  void bind_all();
  void bind_ahead();
  bool bind_next();  // one camera more; false when all are there

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Texels of less confidence are not drawn: of 255 it rounds to 0.
inline constexpr float kLeastConfidence = 0.5f / 255;

// Shares below this are dropped and the others drawn up to it, continuously: a camera that hardly
// counts is not worth its samples. Measured at ten views: up to 0.15 costs no view 0.01 dB; at 0.2
// one loses 0.8 dB, since the third camera alone sees a part of it.
inline constexpr double kLeastShare = 0.15;
ViewWeights trimmed(ViewWeights weights);

}  // namespace organbake
