// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"
#include "picture/spans.h"

namespace organbake {

struct PixelAt {
  int x, y;
};

// Which pixels of a box show skin and which the background, one bit each, so that borders, slits
// are found by whole words. Tools are neither.
class CoverMask {
 public:
  static constexpr int kWord = 64;  // pixels

  // Of a box and the pixels round it, where its skin ends.
  void read(const PixelBox& within, const Frame& frame);
  // A pixel of the box that was open is filled.
  void close(PixelAt pixel) {
    const std::size_t word = word_of(pixel);
    const std::uint64_t bit = bit_of(pixel);
    skin_[word] |= bit, open_[word] &= ~bit;
  }

  const PixelBox& box() const { return box_; }
  // False outside the box.
  bool is_skin(PixelAt pixel) const { return has(skin_, pixel); }
  bool is_open(PixelAt pixel) const { return has(open_, pixel); }

  bool operator==(const CoverMask&) const = default;

  int words() const { return words_; }  // of a row
  const std::uint64_t* skin(int y) const { return &skin_[std::size_t(y - box_.y0) * words_]; }
  const std::uint64_t* open(int y) const { return &open_[std::size_t(y - box_.y0) * words_]; }

  // Of a row's word, those one pixel to the right, or the left, of the row's bits.
  std::uint64_t right_of(const std::uint64_t* row, int word) const {
    return row[word] << 1 | (word > 0 ? row[word - 1] >> (kWord - 1) : 0);
  }
  std::uint64_t left_of(const std::uint64_t* row, int word) const {
    return row[word] >> 1 | (word + 1 < words_ ? row[word + 1] << (kWord - 1) : 0);
  }

  // Of a plane of bits that is laid out as these are; false outside the box.
  bool has(const std::vector<std::uint64_t>& bits, PixelAt p) const {
    if (p.x < box_.x0 || p.y < box_.y0 || p.x >= box_.x1 || p.y >= box_.y1) return false;
    return (bits[word_of(p)] & bit_of(p)) != 0;
  }

  // Calls visit(pixel) for each bit of a row's word.
  template <class Visit>
  void for_each(std::uint64_t bits, int word, int y, const Visit& visit) const {
    for (; bits != 0; bits &= bits - 1)
      visit(PixelAt{box_.x0 + word * kWord + std::countr_zero(bits), y});
  }

 private:
  std::size_t word_of(PixelAt p) const {
    return std::size_t(p.y - box_.y0) * words_ + (p.x - box_.x0) / kWord;
  }
  std::uint64_t bit_of(PixelAt p) const { return std::uint64_t{1} << ((p.x - box_.x0) % kWord); }

  PixelBox box_;
  int words_ = 0;
  std::vector<std::uint64_t> skin_, open_;
};

// No smooth skin falls this far from one pixel to the next, and then goes on level or rises again.
inline constexpr float kStepTexels = 8;

// Between which neighbouring pixels skin ends: one of the two shows skin, the other the background
// or skin that lies behind. One bit for each pair, so that whole words are looked through at once.
class FrontEdges {
 public:
  // Which pixel of a pair is in front: the left or upper one, or the other.
  enum Front : int { first, second };
  // Whether the pixels of a pair lie in a row, or in a column.
  enum Along : int { row, column };

  // Of the background; and, where depths are known, of skin at least deeper_mm behind, where it is
  // no slope: where neither side falls as fast.
  void find(const CoverMask& skin, const SkinDepth* depth = nullptr, float deeper_mm = 0);

  bool empty() const { return !skin_ || skin_->box().empty(); }
  const CoverMask& skin() const { return *skin_; }

  // Bits of the pairs whose left or upper pixel is in the box's row y.
  const std::uint64_t* of_row(Along along, Front front, int y) const {
    return &planes_[along][front][std::size_t(y - skin_->box().y0) * skin_->words()];
  }
  // Of two neighbours; false outside the box.
  bool in_front(PixelAt pixel, PixelAt other) const;
  // By the pair's left or upper pixel.
  bool has(Along along, Front front, PixelAt pair) const {
    return skin_->has(planes_[along][front], pair);
  }

 private:
  void find_borders(int y);
  void find_steps(const SkinDepth& depth, SkinDepth::Level deeper, Along along, int y);

  const CoverMask* skin_ = nullptr;
  std::array<std::array<std::vector<std::uint64_t>, 2>, 2> planes_;
};

// Between two terraces of a CT's slices, seen more from the side than any camera saw them, single
// pixels look through the skin at whatever lies behind. A covered pixel that lies deeper_mm behind
// the nearer of two pixels on either side, along its row or its column, is one: made background,
// the slits' filling closes it. `depth` is looked at in the box and round it. Returns
// the pixels' numbers in the picture, ascending.
std::vector<std::uint32_t> find_see_through(const PixelBox& box, const SkinDepth& depth,
                                            float deeper_mm);

// A slit is a run of at most this many uncovered pixels between skin, down a column or along a row,
// before tools are drawn: a hole between samples, or what opens between two terraces of a CT's
// slices when they are seen more from the side than any camera saw them. Longer runs may be the gap
// between two lobes.
inline constexpr int kWidestSlit = 4;

// Pixels as they were before the last steps of a picture changed them.
class KeptPixels {
 public:
  void clear() { pixels_.clear(); }
  std::size_t size() const { return pixels_.size(); }
  void keep(std::size_t at, const Frame& frame) {
    const std::uint8_t* const rgb = &frame.color.pixels[3 * at];
    pixels_.push_back({static_cast<std::uint32_t>(at),
                       {rgb[0], rgb[1], rgb[2]},
                       frame.cover[at],
                       frame.depth_mm.empty() ? 0 : frame.depth_mm[at]});
  }
  void keep(const PixelBox& box, const Frame& frame);
  // The frame as it was: what was kept first of a pixel holds.
  void restore(Frame& frame) const;

 private:
  struct Pixel {
    std::uint32_t at;
    std::array<std::uint8_t, 3> color;
    Cover cover;
    float depth;  // 0 where the frame keeps none
  };
  std::vector<Pixel> pixels_;
};

// Gives the pixels of all slits in the box of `bits`, which tell the frame's skin, the colours
// between their two ends, in the frame and the bits. Columns go first, rows take what is left.
// Returns how many pixels they are.
std::size_t fill_slits(CoverMask& bits, Frame& frame, KeptPixels& kept);

// Fades skin into the background over some pixels beside where it ends against it, for tissue that
// ends where a picture was cut off and not where it turns away: SkinFinish::border_fade_rad.
// Colours alone change. Runs before tools are drawn, and before the outline is smoothed. box: all
// of the skin. width_px: 2 … SkinFinish::kWidestFade_px, or less for none.
void fade_borders(const PixelBox& box, int width_px, const std::array<std::uint8_t, 3>& background,
                  Frame& frame, KeptPixels& kept);

// To which side a border between skin and what lies behind it steps at an end of a straight
// stretch; none where it ends.
enum BorderStep : int { to_skin = -1, no_step = 0, to_open = 1 };

// Between an outline and the border that it was sampled to, in one pixel beside the border: how
// much of the pixel behind skin covers, and how much of the skin's it does not.
struct OutlineAreas {
  double of_open = 0, of_skin = 0;
};

// Of a stretch's i-th pixel. The outline lies half a pixel off the border at an end, on the side
// that the border steps to, and is taken for straight from there to the stretch's middle.
OutlineAreas areas_of_slope(int length, BorderStep before, BorderStep after, int i);

// The same for a stretch both of whose ends step to one side: a parabola that rises from them, by
// `rise` pixels in the middle.
OutlineAreas areas_of_bow(int length, BorderStep ends, double rise, int i);

// Smooths the outlines of skin, which take one sample a pixel: from the steps of the border between
// an outline's pixels and those behind it follows about where the outline runs between them, and
// with it the share of each pixel that the skin in front covers (Reshetov 2009, "Morphological
// antialiasing"). Both sides of the border are blended by that share, in linear light. Covers stay
// as they are.
//
// Where skin meets a tool nothing is smoothed: tools take several samples a pixel.
class Outline {
 public:
  void soften(const FrontEdges& edges, Frame& frame, KeptPixels& kept);

 private:
  std::vector<std::int8_t> change_;  // by pixel, in 1 / 254 of its share; 0 between calls
};

// The pixels that a ball in the camera's frame may touch, by the box round it: of the picture's
// plane, or of the picture alone. What lies between two balls may touch what lies between boxes of
// the plane; a box clipped first is empty where its ball is out of sight.
PixelBox plane_box_round(const Eigen::Vector3d& middle, double radius, const View& view);
PixelBox box_round(const Eigen::Vector3d& middle, double radius, const View& view);
// A block of the picture's pixels, of eight by eight at most, and the numbers of what may be seen
// in it.
struct PictureBlock {
  PixelBox box;
  std::vector<std::uint32_t> numbers;
};

// All blocks of the picture that boxes touch; those of one number follow on each other.
struct NumberedBox {
  std::uint32_t number;
  PixelBox box;
};
std::vector<PictureBlock> blocks_of(const std::vector<NumberedBox>& boxes, const View& view);

// All blocks that the solids may touch.
std::vector<PictureBlock> solid_blocks(const std::vector<Solid>& solids, const View& view);

// Draws solids lit from the eye into their blocks of a frame that keeps its depth, hidden where
// tissue is nearer; edges are smoothed with 2 × 2 rays a pixel. in_cavity: as the light at the
// scope shows them amid tissue.
void draw_solids(const std::vector<Solid>& solids, const std::vector<PictureBlock>& blocks,
                 const View& view, bool in_cavity, Frame& frame);
// What steel that faces the lamp sends back by the light at the scope, of its colour's square.
inline constexpr float kSteelLit = 0.4f;
// Of its own light, what the tissue round about sends to a tool, RGB.
inline constexpr std::array<float, 3> kTissueMirrored = {0.3f, 0.08f, 0.06f};

// From which on a solid does nothing to skin: most of a shaft.
inline constexpr double kShadeReach_mm = 8;
// A shadow: the lamp's radius, its least penumbra, and how much light a full one takes.
inline constexpr double kLampRadius_mm = 1.5, kLeastSoft_mm = 0.25, kDarkestShadow = 0.72;
// What a solid that touches skin keeps off it, and in what gap that falls to 1/e: of a thick one,
// which hides more of what lies round about, farther away by this share of its radius.
inline constexpr double kOccluded = 0.75, kOccludedNear_mm = 1.5, kOccludedByRadius = 0.5;
// A dent's floor keeps so much light off itself at its darkest, the deeper the darker; it is as
// wide as so many of its tool's radii and depths together.
inline constexpr double kDarkestDent = 0.95, kDentReach = 1.6;
// How near a mirror image must be, and what water mirrors straight down.
inline constexpr double kMirrorReach_mm = 12, kWaterMirror = 0.03;
// Normals from depths: over so many pixels each way, where depth changes by less than this share.
inline constexpr int kNormalReach = 3;
inline constexpr double kSteepestNormal = 0.1;

// What solids do to skin in a frame that keeps its depth, before they are drawn: they darken what
// they nearly touch and the dents that they press, and by the light at the scope they throw shadows
// and are mirrored in its wet film. light_mm: of that light from the eye, camera axes; nothing by
// another. Triangles count by their edges.
void shade_skin_by_solids(const std::vector<Solid>& solids, const View& view,
                          const std::optional<Eigen::Vector3d>& light_mm, Frame& frame,
                          KeptPixels& kept);

// A bead of blood reaches so much farther down a wall, and up, as its radius is divided by these,
// and its middle bulges by a slope; so thick it hides all but 1/e of what lies below, and sends
// back a share of that's red. Down a wall the lamp fades out in it so deep.
inline constexpr double kBloodBelow = 0.06, kBloodAbove = 0.3, kBloodPool_mm = 0.4;
inline constexpr double kBloodBulge = 0.5, kBloodClear_mm = 0.07;
inline constexpr std::array<float, 3> kBlood = {0.42f, 0.018f, 0.014f};
// The lamp in it: cosines from its mirror direction, and its light.
inline constexpr double kBloodDull = 0.984, kBloodShiny = 0.996, kBloodShine = 0.8;
inline constexpr std::array<float, 3> kSmokeLight = {0.42f, 0.43f, 0.45f};

// Colours the skin that blood lies on; light_mm as above. Before tools are drawn.
void draw_blood(const std::vector<BloodLine>& blood, const View& view,
                const std::optional<Eigen::Vector3d>& light_mm, Frame& frame, KeptPixels& kept);
// Over all that is drawn behind it.
void draw_smoke(const std::vector<SmokePuff>& smoke, const View& view, Frame& frame,
                KeptPixels& kept);

// The last steps of a frame, after its tiles: slits opened and filled, borders that a picture
// cut faded, tools drawn, the outline smoothed. The next frame of the same view takes it all back,
// and draws the tiles that changed alone.
class PostProcess {
 public:
  explicit PostProcess(const Lighting& lighting)
      : light_mm_(lighting.scope.value_or(ScopeLight()).offset_mm), finish_(lighting.finish) {}

  // drawn: everything but the background. depth: of its skin. deeper_mm: skin at least so far
  // behind other skin is not one surface with it.
  void apply(const View& view, const DrawOptions& options, const PixelBox& drawn,
             const SkinDepth& depth, float deeper_mm, Frame& frame, DrawReport& report);
  // The frame as it was before apply().
  void undo(Frame& frame) const { kept_.restore(frame); }

 private:
  void draw_tools(const View& view, const DrawOptions& options, Frame& frame);

  Eigen::Vector3d light_mm_;  // at the scope, from the eye, camera axes: tools throw shadows by it
  SkinFinish finish_;
  KeptPixels kept_;
  CoverMask skin_;    // with a border
  FrontEdges edges_;  // of skin_
  Outline outline_;
};

}  // namespace organbake
