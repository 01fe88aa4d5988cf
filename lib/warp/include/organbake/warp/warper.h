// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/geometry/shell.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"

namespace organbake {

struct OrganSource;
struct SampleSet;
struct ScopeShading;

// The skin that a picture shows: the organ's own, or where pixels are larger than its texels one of
// fewer texels, and mostly fewer faces (CoarserOrgan).
struct DrawnSkin {
  const BaseLayer& base;
  const std::vector<ShellMatrix>& shell;  // by its faces, world mm
  std::uint32_t cut_into = 1;             // cut_into² of the organ's own faces lie over each of it
};
// Where a place of the organ's own skin lies on it; the height stays what it is over its own.
BoundPixel on_drawn_skin(const BoundPixel& own, std::uint32_t cut_into);

// The way of a frame, room by room of this module (each includes from those before it only):
//   picture    what all share: boxes of pixels, tiles of 192 × 128, rows, spans of four.
//   samples    once per bundle: a camera's maps become samples, bound to the shell's faces, in
//              chunks of 64 that lie together. SampleStore makes a camera's when a view needs it.
//   placing    the proxy's vertices pose the shell (PosedShell); each face and each chunk of the
//              three active cameras is placed in the view, culled whole, and listed by the tiles
//              that it touches. A view that stays, and faces that stay, are not placed again.
//   light      when the skin is lit anew: gains and normals at the nodes of every face in view.
//   drawing    per tile, or part of a dear one, one thread from first to last: samples bid for
//              pixels with 64-bit keys of depth and slot, which stay in the second-level cache; the
//              base layer goes where they leave gaps; resolve_tile() gathers the winners' colours,
//              lights and blends them.
//   finishing  over the whole picture: slits filled, tools drawn, outlines smoothed.
//   paper      the paper's own warp, a baseline beside all this.
//
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
  // One that draws the organ as blades have cut it, with the samples of this uncut one, which it
  // shares. `now` needs no maps.
  Warper cut(const Bundle& now, const CutOrgan::FaceParts& parts) const;
  // Another that draws the same uncut organ beside this one, from a thread of its own, with the
  // samples of this one, which it shares. `bundle` is the one that this was made of, without maps.
  Warper beside(const Bundle& bundle) const;
  ~Warper();
  Warper(Warper&&) noexcept;
  Warper& operator=(Warper&&) noexcept;

  // positions: the proxy's vertices, world mm. Throws UsageError for a bad view or options, such as
  // a light other than the baked one for a bundle that does not know its own,
  // BadDataError for a wrong number of positions or one that is not finite, and what reading and
  // binding a camera's maps throws.
  DrawReport draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                  const DrawOptions& options, Frame& frame);

  // For another way of drawing (organ_source.h): the organ in a pose, whose light is wanted or
  // not; the samples of a camera, bound now where they were not; what the light at the scope does
  // in a view, where the bundle can be lit anew.
  OrganSource pose(const std::vector<Eigen::Vector3d>& positions, bool lit,
                   const std::vector<SkinFold>& folds = {});
  std::uint64_t id() const;  // OrganSource::id
  const SampleSet& samples(std::size_t camera);
  ScopeShading scope_shading(const View& view, double reference_mm) const;

  // Whether the bundle knows its light, and has the base layer that it falls on.
  bool can_relight() const;
  // The light that it is meant to be seen in: at the scope when its lighting has that, else the
  // world's, else what was baked.
  DrawnLight default_light() const;

  // The shell as it was last drawn, world mm, by face.
  const std::vector<ShellMatrix>& shell_matrices() const;
  // What the last picture was drawn of; leads into the Warper.
  DrawnSkin drawn_skin() const;

  // Binds all cameras now, or from a thread of its own while frames are drawn: turning the view
  // then never waits. Frames are the same either way.
  void bind_all();
  void bind_ahead();
  bool bind_next();  // one camera more; false when all are there

 private:
  struct Impl;
  explicit Warper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// What was drawn last, to recognise when nothing, or little, has changed since: one drawing, or, of
// organs that two eyes look at turn about, both eyes'.
class LastDrawing {
 public:
  // first_serial: of frames, for whoever draws beside another program's part that counts from 0.
  explicit LastDrawing(std::uint64_t first_serial = 0) : first_serial_(first_serial) {}

  // The report on the drawing of this view that the frame holds, the organs lying as in the last.
  std::optional<DrawReport> unchanged(const View& view, const DrawOptions& options,
                                      const Frame& frame) const;
  // Whether the frame holds the last one, of the same view, with at most other tools in it.
  bool continues(const View& view, const DrawOptions& options, const Frame& frame) const;

  // The frame holds this drawing from now on; still: organs lie as in the one before.
  void remember(const View& view, const DrawOptions& options, const DrawReport& report, bool still,
                Frame& frame);

 private:
  struct Drawing {
    View view;
    DrawOptions options;
    DrawReport report;
    std::uint64_t serial = 0;

    bool is_in(const Frame& frame) const { return serial != 0 && frame.serial == serial; }
  };
  std::uint64_t first_serial_;
  std::array<Drawing, 2> drawings_;  // the last one first
};

// Several organs in one picture: each is drawn by its own warper, and every pixel shows the one
// that is nearest to the eye, the first at ties. One light falls on all of them, that of the first
// organ that has one, its exposure metered over all. Outlines are smoothed once the organs are
// together: against the background, and against skin that lies so far behind that it is no longer
// one surface. One organ alone is drawn as its warper draws it.
class JointDrawing {
 public:
  // Nothing is kept by reference after draw().
  struct Organ {
    Warper& warper;
    const std::vector<Eigen::Vector3d>& positions_mm;  // of the proxy's vertices, world
    const TriangleMesh& proxy_at_rest;
    const std::optional<Lighting>& lighting;
  };

  // Throws what Warper::draw() does. The report has the sums of what was drawn, the largest
  // texels, and the first organ's cameras.
  DrawReport draw(const std::vector<Organ>& organs, const View& view, const DrawOptions& options,
                  Frame& frame);

 private:
  void join(const DrawOptions& options, float deeper_mm, Frame& frame) const;

  std::vector<Frame> pictures_;  // of each organ alone
  std::uint64_t serial_ = 0;     // of the last joint picture
};

}  // namespace organbake
