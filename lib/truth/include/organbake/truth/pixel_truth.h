// SPDX-License-Identifier: Apache-2.0
#pragma once

// What is known of every pixel of a picture beside its colour: layers, what the ray through it
// meets, and where that point lies in the picture before or after.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/geometry/shell.h"
#include "organbake/player/player.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"

namespace organbake {

// What can be told of every pixel of a picture beside its colour.
struct LayerSet {
  bool depth = false;    // planar z, mm, +inf at the background
  bool flow = false;     // to the next frame and the last one, px
  bool normals = false;  // camera axes, unit, towards the eye
  bool mask = false;     // labels of organs and instruments
  bool id = false;       // the skin point: organ, face, b1, b2, height
  bool weight = false;   // of the baked samples behind the colour

  bool any() const { return depth || flow || normals || mask || id || weight; }
  bool operator==(const LayerSet&) const = default;
};

// Their names, in that order.
const std::vector<std::string>& layer_names();
// "depth,mask" or "all". Throws UsageError for another name, saying which there are.
LayerSet layers_from(std::string_view text);

// Where everything lay when a picture was drawn: enough to say where any of its points was then.
struct Moment {
  // A shell matrix in the camera's frame, mm; each column in a register of its own.
  using Columns = Eigen::Matrix<float, 4, 9>;

  struct Skin {
    std::vector<Columns> shell;  // by face; empty unless asked for
    // What the picture was drawn of, where that is not the organ's own skin; else its faces alone
    // are told, above.
    std::vector<Columns> drawn_shell;
    const BaseLayer* drawn_base = nullptr;  // the warper's
    std::uint32_t cut_into = 1;
  };

  View view;
  std::vector<Skin> skins;  // by organ
  std::vector<Solid> solids;

  // organs: as each was drawn last. with_places: whether place() is asked for. bound_as_drawn: as
  // the frame says; places are not asked for then.
  void take(std::span<const Warper* const> organs, const View& from,
            const std::vector<Solid>& tools, bool with_places, bool bound_as_drawn);

  // Of a bound point, camera mm.
  Eigen::Vector3f place(std::size_t organ, const BoundPixel& p) const {
    const Columns& m = skins[organ].shell[p.face];
    return shell_point(m, p.b1, p.b2, p.height_mm).head<3>();
  }

  // Whether the skin round a bound point is turned to the eye, by the small triangle of the base
  // layer that it lies over: near an outline this decides to a fraction of a pixel, where samples,
  // each with the mean slope of its patch, reach a little over it.
  bool faces_eye(std::size_t organ, const BoundPixel& point) const;
};

// Labels of a mask: 0 the background, the organs from kFirstOrganLabel on, the instruments from
// kFirstToolLabel on, both in the order in which they were given.
inline constexpr std::uint8_t kFirstOrganLabel = 1, kFirstToolLabel = 101;
inline constexpr std::size_t kMostLabelledOrgans = 100, kMostLabelledTools = 155;

// What the ray through each pixel's centre meets first. All planes have one number a pixel, top row
// first; those that were not asked for are empty.
struct PixelTruth {
  int width = 0, height = 0;
  std::vector<BoundPixel> bound;        // the skin, below tools, too
  std::vector<std::uint8_t> organ;      // whose; empty: the one and only
  std::vector<float> depth_mm;          // planar z, +inf at the background
  std::vector<std::uint8_t> label;      // see above
  std::vector<Eigen::Vector3f> point;   // camera mm; of no meaning at the background; with normals
  std::vector<Eigen::Vector3f> normal;  // camera axes, unit, towards the eye; 0 at the background
  std::vector<std::uint16_t> solid;     // 1 + the moment's solid, 0: none; empty without tools

  std::size_t pixels() const { return std::size_t(width) * height; }
  std::size_t organ_at(std::size_t pixel) const { return organ.empty() ? 0 : organ[pixel]; }
  std::size_t solid_at(std::size_t pixel) const { return solid.empty() ? 0 : solid[pixel]; }
};

// Where the point that each pixel of one picture shows lies in another, px: to, minus from.
struct Flow {
  std::vector<Eigen::Vector2f> px;  // 0 at the background
  // Whether the other picture shows the point as well: it lies inside, is turned to the eye, and
  // nothing lies before it.
  std::vector<std::uint8_t> seen;
};

// Skin moves as it is bound; a tool's points move with its axis. A point that comes to lie behind
// the eye, or on a tool that is taken away, is not seen and does not move.
// The same for any number of threads.
void find_flow(const PixelTruth& from, const Moment& then, const PixelTruth& to, const Moment& now,
               Flow& flow);

// The truth beside the pictures of one eye, one after the other.
class TruthTracker {
 public:
  explicit TruthTracker(const LayerSet& layers) : layers_(layers) {}

  // The picture that the player drew last, with DrawOptions::keep_bound; its bound pixels are taken
  // out of it. tools: those that were drawn.
  void advance(const Player& player, const View& view, const std::vector<Solid>& tools,
               Frame& picture);
  // The same of organs that are drawn without a player, uncut.
  void advance(std::span<const Warper* const> organs, const View& view,
               const std::vector<Solid>& tools, Frame& picture);
  void forget() { pictures_ = 0; }

  const LayerSet& layers() const { return layers_; }
  const PixelTruth& now() const { return truths_[pictures_ % 2]; }
  const Moment& moment() const { return moments_[pictures_ % 2]; }
  // Of the picture before; nothing at the first, and where flow is not asked for.
  bool has_before() const { return pictures_ > 1; }
  const PixelTruth& before() const { return truths_[(pictures_ + 1) % 2]; }
  const Moment& moment_before() const { return moments_[(pictures_ + 1) % 2]; }

  void find_backward(Flow& flow) const {  // from now to before
    find_flow(now(), moment(), before(), moment_before(), flow);
  }
  void find_forward(Flow& flow) const {  // from before to now
    find_flow(before(), moment_before(), now(), moment(), flow);
  }

 private:
  LayerSet layers_;
  std::size_t pictures_ = 0;
  std::array<PixelTruth, 2> truths_;
  std::array<Moment, 2> moments_;
};

}  // namespace organbake
