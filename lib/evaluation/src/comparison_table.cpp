// SPDX-License-Identifier: Apache-2.0
// The paper's evaluation (3.2, Table 1) of a bundle that carries its true surface: from each
// viewing angle, at rest and poked, the player's picture, that of the paper's own warp, and the
// best that the maps allow (ideal_picture()), all held against the truth ray by ray.
#include "organbake/evaluation/comparison_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/orbit.h"
#include "organbake/player/skin_point.h"
#include "organbake/warp/paper_warp.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

// What one camera knows of a point.
struct Read {
  Vector3f color;
  float confidence;
};

// Weights of four texels, the point between the second and third at t (Catmull & Rom 1974).
std::array<float, 4> catmull_rom_weights(float t) {
  return {0.5f * t * (-1 + t * (2 - t)), 0.5f * (2 + t * t * (-5 + 3 * t)),
          0.5f * t * (1 + t * (4 - 3 * t)), 0.5f * t * t * (-1 + t)};
}

std::optional<Read> read_at(const CameraMaps& maps, const PosedCamera& camera,
                            const Eigen::Vector3d& world_mm) {
  constexpr double kSameSurfaceTexels = 6;
  const Eigen::Vector3d p = camera.camera_from_world * world_mm;
  if (p.z() <= 0) return std::nullopt;
  const Eigen::Vector2d pixel = project(camera.intrinsics, p);
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 1 && v >= 1 && u < maps.width - 2 && v < maps.height - 2)) return std::nullopt;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const auto wx = catmull_rom_weights(static_cast<float>(u - x)),
             wy = catmull_rom_weights(static_cast<float>(v - y));
  const double same_mm = kSameSurfaceTexels * p.z() / camera.intrinsics.fx;
  Read read{Vector3f::Zero(), 1};
  float sum = 0;
  for (int dy = -1; dy <= 2; ++dy) {
    for (int dx = -1; dx <= 2; ++dx) {
      const std::size_t i = std::size_t(y + dy) * maps.width + (x + dx);
      const bool inner = (dx == 0 || dx == 1) && (dy == 0 || dy == 1);
      const bool same = maps.face[i] != kNoFace && std::abs(maps.depth_mm[i] - p.z()) <= same_mm;
      if (inner && !same) return std::nullopt;
      if (inner) read.confidence = std::min(read.confidence, maps.confidence[i]);
      if (!same) continue;  // the outer ring may lie on other skin, and is left out
      const float w = wx[dx + 1] * wy[dy + 1];
      read.color += w * maps.color[i];
      sum += w;
    }
  }
  if (!(sum > 0.5f)) return std::nullopt;
  read.color = (read.color / sum).cwiseMax(0.0f);
  return read;
}

class Resampler {
 public:
  Resampler(const Bundle& bundle, const View& view)
      : bundle_(bundle), shares_(drawn_shares(bundle.cameras.manifold, view)) {}

  std::optional<Vector3f> color(const Eigen::Vector3d& at_rest) const {
    Vector3f sum = Vector3f::Zero();
    float weight = 0;
    const auto add = [&](std::size_t c, float share) {
      const auto read = read_at(bundle_.maps[c], bundle_.cameras.cameras[c], at_rest);
      if (!read) return;
      sum += share * read->confidence * read->color;
      weight += share * read->confidence;
    };
    for (int i = 0; i < 3; ++i)
      if (shares_.weights[i] > 0) add(shares_.cameras[i], static_cast<float>(shares_.weights[i]));
    for (std::size_t c = 0; !(weight > 0) && c < bundle_.maps.size(); ++c) add(c, 1);
    if (!(weight > 0)) return std::nullopt;
    return sum / weight;
  }

 private:
  const Bundle& bundle_;
  ViewWeights shares_;
};

}  // namespace

Rgb8Image ideal_picture(const Bundle& bundle, const CarriedSurface& truth,
                        const std::vector<Eigen::Vector3d>& proxy_positions, const View& view,
                        const std::array<std::uint8_t, 3>& background) {
  const auto seen = truth.seen_at_centers(truth.carry(proxy_positions), view);
  const TriangleMesh& rest = truth.at_rest();
  const Resampler resampler(bundle, view);
  Rgb8Image picture(view.camera.intrinsics.width, view.camera.intrinsics.height);
  parallel_for(std::size_t{0}, seen.size(), [&](std::size_t i) {
    std::uint8_t* const rgb = &picture.pixels[3 * i];
    if (seen[i].face == kNoFace) {
      std::copy(background.begin(), background.end(), rgb);
      return;
    }
    const auto [a, b, c] = rest.faces[seen[i].face];
    const Vector3f own = (1 - seen[i].w1 - seen[i].w2) * rest.colors[a] +
                         seen[i].w1 * rest.colors[b] + seen[i].w2 * rest.colors[c];
    const Vector3f color = resampler.color(truth.point(seen[i], rest.vertices)).value_or(own);
    for (int k = 0; k < 3; ++k) rgb[k] = srgb8_from_linear(color[k]);
  });
  return picture;
}

namespace {

constexpr std::array<std::uint8_t, 3> kBlack = {0, 0, 0};

// The pixels that the truth covers with all their neighbours, so that no silhouette is mistaken for
// a hole.
std::vector<std::size_t> inner_pixels(const TruthFrame& truth) {
  const int w = truth.color.width, h = truth.color.height;
  std::vector<std::size_t> inner;
  for (int y = 1; y + 1 < h; ++y) {
    for (int x = 1; x + 1 < w; ++x) {
      bool inside = true;
      for (int dy = -1; dy <= 1 && inside; ++dy) {
        for (int dx = -1; dx <= 1; ++dx)
          inside &= truth.covered[std::size_t(y + dy) * w + x + dx] != 0;
      }
      if (inside) inner.push_back(std::size_t(y) * w + x);
    }
  }
  return inner;
}

std::size_t count_covers(const Frame& frame, const std::vector<std::size_t>& inner, Cover wanted) {
  return static_cast<std::size_t>(std::count_if(
      inner.begin(), inner.end(), [&](std::size_t i) { return frame.cover[i] == wanted; }));
}

bool shows_any(const Rgb8Image& on_black, std::size_t pixel) {
  return !std::equal(kBlack.begin(), kBlack.end(), &on_black.pixels[3 * pixel]);
}

// With an outline as smooth as the player's, so that what is compared is what lies inside.
Rgb8Image smoothed(Rgb8Image on_black) {
  Frame frame;
  frame.cover.assign(on_black.pixels.size() / 3, Cover::background);
  for (std::size_t i = 0; i < frame.cover.size(); ++i) {
    if (shows_any(on_black, i)) frame.cover[i] = Cover::samples;
  }
  frame.color = std::move(on_black);
  smooth_outlines(frame);
  return std::move(frame.color);
}

class Comparer {
 public:
  Comparer(Player& player, const TriangleMesh& surface, const CompareOptions& options)
      : player_(player),
        truth_(surface, player.bundle().shell()),
        projection_(player.bundle(), truth_),
        paper_(player.bundle()),
        size_(options.size_px) {
    draw_options_.background = kBlack;
    draw_options_.light = DrawnLight::baked;  // as the truth is drawn
  }

  ComparisonRow row(double angle, bool poked) {
    const View view = view_at(angle);
    ComparisonRow row;
    row.angle_rad = angle;
    row.poked = poked;
    row.projection = projection_.measure(player_.proxy_positions(), view);
    const TruthFrame truth = true_frame(view);
    const std::vector<std::size_t> inner = inner_pixels(truth);
    row.inner_pixels = inner.size();
    DrawOptions telling = draw_options_;
    telling.keep_bound = true;
    const auto& positions = player_.proxy_positions();
    paper_.draw(positions, view, draw_options_, frame_);
    row.paper = picture_errors(truth, inner);
    player_.draw(view, telling, frame_);
    row.picture = picture_errors(truth, inner);
    row.filled_pixels = count_covers(frame_, inner, Cover::filled);
    row.displayed = projection_.displayed(frame_, positions, view);
    const Rgb8Image ideal =
        smoothed(ideal_picture(player_.bundle(), truth_, positions, view, kBlack));
    row.ideal = errors_of(ideal, truth);
    row.seams = edge_steps(frame_.color, truth);
    return row;
  }

  // Just before and just after the angle at which the view's set of cameras changes.
  SeamSteps switch_at(double angle, double half_step) {
    const View before = view_at(angle - half_step), after = view_at(angle + half_step);
    player_.draw(before, draw_options_, frame_);
    const Rgb8Image first = frame_.color;
    player_.draw(after, draw_options_, frame_);
    return switch_steps(first, frame_.color, true_frame(before), true_frame(after));
  }

  // Angles of one turn at which another triangle of the VPM takes over.
  std::vector<double> switch_angles() const {
    constexpr int kSteps = 3600;
    std::vector<double> angles;
    std::set<std::uint32_t> last = cameras_at(0);
    for (int step = 1; step <= kSteps; ++step) {
      double low = 2 * std::numbers::pi * (step - 1) / kSteps,
             high = 2 * std::numbers::pi * step / kSteps;
      const std::set<std::uint32_t> now = cameras_at(high);
      if (now == last) continue;
      for (int i = 0; i < 40; ++i) {  // bisection down to rounding
        const double middle = 0.5 * (low + high);
        (cameras_at(middle) == last ? low : high) = middle;
      }
      angles.push_back(high);
      last = now;
    }
    return angles;
  }

 private:
  // The outline's pixels show skin, too, where it covers a part of them only.
  static PictureErrors errors_of(const Rgb8Image& on_black, const TruthFrame& truth) {
    std::vector<std::uint8_t> either = truth.covered;
    for (std::size_t i = 0; i < either.size(); ++i) either[i] |= shows_any(on_black, i);
    return {compare_images(on_black, truth.color, either).psnr_db,
            structural_similarity(on_black, truth.color, either), 0};
  }
  // Of frame_.
  PictureErrors picture_errors(const TruthFrame& truth, const std::vector<std::size_t>& inner) {
    PictureErrors errors = errors_of(frame_.color, truth);
    errors.holes = count_covers(frame_, inner, Cover::background);
    return errors;
  }
  View view_at(double angle) const {
    return orbit_view(player_.bundle().cameras, {angle}, size_, size_);
  }
  TruthFrame true_frame(const View& view) const {
    return truth_.draw(truth_.carry(player_.proxy_positions()), view, kBlack);
  }
  std::set<std::uint32_t> cameras_at(double angle) const {
    const ViewManifold& manifold = player_.bundle().cameras.manifold;
    const ViewWeights w =
        view_weights(manifold, view_at(angle).camera.center_world_mm() - manifold.center_world_mm);
    return {w.cameras.begin(), w.cameras.end()};
  }

  Player& player_;
  CarriedSurface truth_;
  ProjectionComparison projection_;
  PaperWarp paper_;
  int size_;
  DrawOptions draw_options_;
  Frame frame_;
};

Json errors_json(const PixelErrors& e) {
  return {{"mean_px", e.mean_px},
          {"nearly_all_px", e.nearly_all_px},
          {"max_px", e.max_px},
          {"vertices", e.vertices}};
}

Json steps_json(const SeamSteps& s) {
  return {
      {"frame", s.frame}, {"truth", s.truth}, {"largest_excess", s.excess}, {"places", s.places}};
}

std::string cell(const std::string& text, std::size_t width) {
  return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

}  // namespace

ComparisonTable compare_with_truth(Player& player, const TriangleMesh& surface,
                                   const CompareOptions& options, const RunContext& context) {
  Comparer comparer(player, surface, options);
  ComparisonTable table;
  const Bundle& bundle = player.bundle();
  constexpr double kRows = 0.8;  // of the time
  context.progress(0);
  for (const bool poked : {false, true}) {
    player.reset();
    // Half-way between the viewing angles' extremes would be out of some views: poke the front.
    if (poked) {
      hold_poke(player, poke_direction(bundle), CompareOptions::kPokeShare,
                bundle.mechanics.instrument_radius_mm);
    }
    for (const double angle : options.angles_rad) {
      context.throw_if_cancelled();
      table.rows.push_back(comparer.row(angle, poked));
      context.progress(kRows * double(table.rows.size()) / double(2 * options.angles_rad.size()));
    }
  }
  player.reset();
  constexpr double kHalfStep = 1e-5;  // rad: moves the picture by 0.01 pixel
  for (const double angle : comparer.switch_angles()) {
    context.throw_if_cancelled();
    const SeamSteps steps = comparer.switch_at(angle, kHalfStep);
    ++table.switches;
    if (steps.excess >= table.camera_switch.excess) table.camera_switch = steps;
  }
  context.progress(1);
  return table;
}

std::string comparison_json(const ComparisonTable& table) {
  Json rows = Json::array();
  for (const ComparisonRow& row : table.rows) {
    rows.push_back(
        {{"angle_rad", row.angle_rad},
         {"state", row.poked ? "poked" : "rest"},
         {"visible_vertices", row.projection.visible},
         {"without_map", row.projection.without_map},
         {"image_based", errors_json(row.projection.image_based)},
         {"polygons", errors_json(row.projection.polygons)},
         {"displayed", errors_json(row.displayed)},
         {"psnr_db", row.picture.psnr_db},
         {"ssim", row.picture.ssim},
         {"inner_pixels", row.inner_pixels},
         {"filled_pixels", row.filled_pixels},
         {"holes", row.picture.holes},
         {"paper_warp",
          {{"psnr_db", row.paper.psnr_db}, {"ssim", row.paper.ssim}, {"holes", row.paper.holes}}},
         {"ideal_resampler", {{"psnr_db", row.ideal.psnr_db}, {"ssim", row.ideal.ssim}}},
         {"edge_step_8bit", steps_json(row.seams)}});
  }
  return json_text({{"schema", "organbake/comparison/1"},
                    {"rows", rows},
                    {"camera_switches", table.switches},
                    {"camera_switch_step_8bit", steps_json(table.camera_switch)}});
}

std::string comparison_text(const ComparisonTable& table) {
  std::string text =
      "state  view deg     warp off px   at most      no map   polygons px"
      " at most    PSNR dB      (paper's, ideal)   skin off px  holes     seams   truth    more\n";
  for (const ComparisonRow& row : table.rows) {
    const auto& image = row.projection.image_based;
    const auto& polygons = row.projection.polygons;
    const double no_map = 100.0 * double(row.projection.without_map) /
                          double(std::max<std::size_t>(row.projection.visible, 1));
    text +=
        std::string(row.poked ? "poked" : "rest ") +
        cell(to_text(row.angle_rad * (180 / std::numbers::pi), 1), 10) +
        cell(to_text(image.mean_px, 4), 16) + cell(to_text(image.max_px, 3), 10) +
        cell(to_text(no_map, 1) + " %", 12) + cell(to_text(polygons.mean_px, 2), 14) +
        cell(to_text(polygons.max_px, 1), 8) + cell(to_text(row.picture.psnr_db, 2), 11) +
        cell("(" + to_text(row.paper.psnr_db, 2) + ", " + to_text(row.ideal.psnr_db, 2) + ")", 22) +
        cell(to_text(row.displayed.mean_px, 3), 14) + cell(std::to_string(row.picture.holes), 7) +
        cell(to_text(row.seams.frame, 1), 10) + cell(to_text(row.seams.truth, 1), 8) +
        cell(to_text(row.seams.excess, 1), 8) + "\n";
  }
  return text + "camera switches on the orbit: " + std::to_string(table.switches) +
         ", largest step " + to_text(table.camera_switch.frame, 2) + "/255 (truth " +
         to_text(table.camera_switch.truth, 2) + ")\n";
}

}  // namespace organbake
