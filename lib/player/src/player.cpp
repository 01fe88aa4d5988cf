// SPDX-License-Identifier: Apache-2.0
// The player's organs, each with its bundle, its warper and its pose; stepping and drawing them, by
// the processor or by another way of drawing that was handed in. Cuts are in player_cuts.cpp.
#include "organbake/player/player.h"

#include <algorithm>
#include <set>
#include <utility>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/geometry/refine.h"

namespace organbake {

DeformBody Player::deform_body(const Bundle& organ) {
  return {organ.proxy, organ.mechanics, organ.base, organ.skin ? &*organ.skin : nullptr};
}

DeformBodies Player::deform_bodies(const std::vector<Organ>& organs) {
  DeformBodies bodies;
  for (const Organ& organ : organs) bodies.push_back(deform_body(organ.now()));
  return bodies;
}

Player::Organ Player::bound(Bundle bundle, bool keep_maps) {
  Warper warper(bundle);
  if (!keep_maps) bundle.maps.clear();  // the bound samples say all that drawing needs
  std::vector<Eigen::Vector3d> positions = bundle.proxy.vertices;
  return {std::move(bundle), std::move(warper), std::move(positions)};
}

Player::Organ Player::opened(const std::filesystem::path& bundle_folder, bool keep_maps) {
  const BundleReader reader(bundle_folder);
  if (keep_maps) return bound(reader.read_all(), true);
  Bundle bundle = reader.read_frame();
  const auto read = [reader, cameras = bundle.cameras.cameras,
                     faces = shell_face_count(bundle)](std::size_t c) {
    return reader.read_maps(c, cameras[c].intrinsics, faces);
  };
  return streamed(std::move(bundle), read);
}

Player::Organ Player::streamed(Bundle frame, Warper::ReadMaps read) {
  Warper warper(frame, std::move(read));
  frame.maps.clear();
  std::vector<Eigen::Vector3d> positions = frame.proxy.vertices;
  return {std::move(frame), std::move(warper), std::move(positions)};
}

std::vector<Player::Organ> Player::one_of(Organ organ) {
  std::vector<Organ> organs;
  organs.push_back(std::move(organ));
  return organs;
}

std::vector<Player::Organ> Player::opened(const std::vector<std::filesystem::path>& folders,
                                          bool keep_maps) {
  std::vector<Organ> organs;
  organs.reserve(folders.size());
  for (const auto& folder : folders) organs.push_back(opened(folder, keep_maps));
  return organs;
}

std::vector<Player::Organ> Player::bound(std::vector<Bundle> bundles, bool keep_maps) {
  std::vector<Organ> organs;
  organs.reserve(bundles.size());
  for (Bundle& bundle : bundles) organs.push_back(bound(std::move(bundle), keep_maps));
  return organs;
}

Player::Player(std::vector<Organ> organs, const DeformOptions& options)
    : organs_(std::move(organs)),
      options_(options.chosen_for(deform_bodies(organs_))),
      deformer_(deform_bodies(organs_), options_) {
  if (organs_.empty()) throw UsageError("a player needs a bundle");
}

Player::Player(std::vector<Bundle> bundles, const DeformOptions& options, bool keep_maps)
    : Player(bound(std::move(bundles), keep_maps), options) {}

Player::Player(Bundle bundle, const DeformOptions& options, bool keep_maps)
    : Player(std::vector<Bundle>{std::move(bundle)}, options, keep_maps) {}

Player::Player(Bundle frame, Warper::ReadMaps read, const DeformOptions& options)
    : Player(one_of(streamed(std::move(frame), std::move(read))), options) {}

Player::Player(const std::filesystem::path& bundle_folder, const DeformOptions& options,
               bool keep_maps)
    : Player(std::vector<std::filesystem::path>{bundle_folder}, options, keep_maps) {}

Player::Player(const std::vector<std::filesystem::path>& bundle_folders,
               const DeformOptions& options, bool keep_maps)
    : Player(opened(bundle_folders, keep_maps), options) {}

void Player::load_all() {
  for (Organ& organ : organs_) organ.shown().bind_all();
}

void Player::load_ahead() {
  for (Organ& organ : organs_) organ.warper.bind_ahead();
}

bool Player::load_next() {
  return std::any_of(organs_.begin(), organs_.end(),
                     [](Organ& organ) { return organ.warper.bind_next(); });
}

const Player::Organ& Player::organ_at(std::size_t organ) const {
  if (organ < organs_.size()) return organs_[organ];
  throw UsageError("there is no organ " + std::to_string(organ) + " of " +
                   std::to_string(organs_.size()));
}

Warper Player::warper_beside(std::size_t number) const {
  const Organ& organ = organ_at(number);
  if (organ.cut_warper)
    throw UsageError("several pictures at once are drawn of organs as they were baked, and '" +
                     organ.bundle.manifest.name + "' has been cut; reset it first");
  return organ.warper.beside(organ.bundle);
}

bool Player::can_relight() const {
  return std::any_of(organs_.begin(), organs_.end(),
                     [](const Organ& organ) { return organ.warper.can_relight(); });
}

bool Player::can_cut() const { return options_.solver == TissueSolver::fem; }

std::string Player::solver_text() const {
  if (!can_cut()) return "springs";
  std::size_t tetrahedra = 0;
  for (const Organ& organ : organs_) tetrahedra += organ.now().mechanics.body->tetrahedra.size();
  return "finite elements (" + std::to_string(tetrahedra) + " tetrahedra)";
}

DrawnLight Player::light_for(std::optional<DrawnLight> asked) const {
  DrawnLight usual = DrawnLight::baked;
  for (const Organ& organ : organs_) usual = std::max(usual, organ.warper.default_light());
  if (asked && *asked != DrawnLight::baked && !can_relight())
    throw UsageError("the organ '" + bundle().manifest.name +
                     "' does not say in what light its colours were taken: light " +
                     to_string(*asked) +
                     " cannot be shown; take the light baked, or bake it with a lighting");
  return asked.value_or(usual);
}

StepReport Player::step(const std::vector<Instrument>& instruments) {
  const bool placed = go_on_from_placed();
  cut(instruments);
  StepReport report = deformer_.step(instruments);
  if (placed || deformer_.moved()) take_positions();
  leave_holes(instruments, report.punctures);
  return report;
}

void Player::reset() {
  if (make_whole()) deformer_ = Deformer(deform_bodies(organs_), options_);
  deformer_.reset();
  take_positions();
}

void Player::play_by(TissueSolver solver, double stiffness) {
  if (solver == this->solver() && stiffness == options_.stiffness) return reset();
  DeformOptions options = options_;
  options.solver = solver, options.stiffness = stiffness;
  options.check();
  make_whole();  // of springs it changes nothing: they cannot be cut
  deformer_ = Deformer(deform_bodies(organs_), options);
  options_ = options;
  take_positions();
}

bool Player::make_whole() {
  steps_ = 0;
  pending_cut_.reset();
  cutting_edges_.forget();
  bool was_cut = false;
  for (Organ& organ : organs_) {
    was_cut = was_cut || organ.cut_warper;
    organ.cut_warper.reset();
    organ.cutting.reset();
    organ.sweeps.reset();
    organ.placed.reset();
    organ.positions.resize(organ.bundle.proxy.vertices.size());
  }
  return was_cut;
}

void Player::take_positions() {
  auto next = deformer_.positions().begin();
  for (Organ& organ : organs_) {
    const auto end = next + static_cast<std::ptrdiff_t>(organ.positions.size());
    std::copy(next, end, organ.positions.begin());
    next = end;
  }
}

std::vector<Eigen::Vector3d> Player::Organ::drawn_positions() const {
  std::vector<Eigen::Vector3d> drawn = positions;
  if (cut_warper) cutting->gape().open(drawn);
  return drawn;
}

// How deep and in what direction a tip has pressed in the skin that is nearest to it, mm: by where
// faces lie and lay at rest, whoever moved them. It fades where the tip goes, from two radii to
// four.
Eigen::Vector3d Player::pressed_by(const Solid& tip) const {
  double nearest_mm = 4 * tip.radius_mm;
  Eigen::Vector3d pressed_mm = Eigen::Vector3d::Zero();
  for (const Organ& organ : organs_) {
    const TriangleMesh& rest = organ.now().proxy;
    for (const Face& face : rest.faces) {
      const auto now = [&](int c) -> const auto& { return organ.positions[face[c]]; };
      const Eigen::Vector3d share = nearest_on_triangle(tip.from, now(0), now(1), now(2));
      Eigen::Vector3d place = Eigen::Vector3d::Zero(), moved = Eigen::Vector3d::Zero();
      for (int c = 0; c < 3; ++c) place += share[c] * now(c);
      const Eigen::Vector3d way = place - tip.from;
      if (way.norm() >= nearest_mm) continue;
      nearest_mm = way.norm();
      for (int c = 0; c < 3; ++c) moved += share[c] * (now(c) - rest.vertices[face[c]]);
      const Eigen::Vector3d inward = way.stableNormalized();
      const double near = std::clamp(2 - nearest_mm / (2 * tip.radius_mm), 0.0, 1.0);
      pressed_mm = near * std::max(0.0, moved.dot(inward)) * inward;
    }
  }
  return pressed_mm;
}

// What a picture's options leave to the player: the light, how deep tools have pressed skin in, and
// what jaws fold. Of a tool's parts the first is its tip; of a grasper it is a jaw, from the hinge
// to both corners of its end, and the next the other. The fold lies along the skin, half-way
// between.
void Player::complete(DrawOptions& options) const {
  options.light = light_for(options.light);
  std::set<std::uint32_t> told;
  for (Solid& solid : options.solids)
    if (told.insert(solid.instrument).second) solid.pressed_mm = pressed_by(solid);
  options.blood.clear(), options.smoke.clear();
  const double step_s = options_.time_step_s, shown = double(steps_) - kCutDelaySteps;
  for (const Organ& organ : organs_) {
    if (organ.sweeps && organ.cutting->alive())
      add_smoke(organ.sweeps->sheet(), organ.bundle.lighting->up, double(steps_), step_s,
                options.smoke);
    if (organ.cut_warper)
      organ.cutting->bleeding().add_blood(organ.drawn_positions(), shown, step_s, options.blood);
  }
  options.folds.clear();
  for (const Grip& grip : deformer_.grips()) {
    const auto jaw = std::find_if(
        options.solids.begin(), options.solids.end(),
        [&](const Solid& solid) { return solid.instrument == grip.instrument && solid.corner; });
    if (options.solids.end() - jaw < 2) continue;
    const Eigen::Vector3d at = jaw->to, other = std::next(jaw)->to;
    const Eigen::Vector3d closes = (at - other).stableNormalized();
    const Eigen::Vector3d along = grip.outward.cross(closes);
    const double aside_mm = closes.dot(0.5 * (at + other) - grip.position_mm);
    options.folds.push_back({grip.position_mm + aside_mm * closes, along.stableNormalized(),
                             grip.outward, (*jaw->corner - at).norm(), grip.closed * along.norm()});
  }
}

DrawReport Player::draw(const View& view, DrawOptions options, Frame& frame) {
  if (drawing_) {
    complete(options);
    if (const auto report = draw_otherwise(view, options, frame)) return *report;
  }
  return draw_by_processor(view, options, frame);
}

DrawReport Player::draw_by_processor(const View& view, DrawOptions options, Frame& frame) {
  complete(options);
  if (organs_.size() > 1) return draw_organs(view, options, frame);
  Organ& organ = organs_.front();
  return organ.shown().draw(organ.drawn_positions(), view, options, frame);
}

DrawReport Player::draw_at_rest(const View& view, DrawOptions options, Frame& frame) {
  options.light = light_for(options.light);
  if (resting_.empty())
    for (const Organ& organ : organs_) resting_.push_back(organ.warper.beside(organ.bundle));
  if (organs_.size() == 1)
    return resting_.front().draw(organs_.front().bundle.proxy.vertices, view, options, frame);
  std::vector<JointDrawing::Organ> drawn;
  for (std::size_t o = 0; o < organs_.size(); ++o) {
    const Bundle& bundle = organs_[o].bundle;
    drawn.push_back({resting_[o], bundle.proxy.vertices, bundle.proxy, bundle.lighting});
  }
  return resting_drawing_.draw(drawn, view, options, frame);
}

std::vector<Eigen::Vector3d> Player::node_positions(std::size_t organ) const {
  organ_at(organ);
  if (options_.solver != TissueSolver::fem) return {};
  return deformer_.node_positions(organ);
}

// use() of the organs as they lie now.
template <class Use>
auto Player::with_drawn_organs(const Use& use) {
  std::vector<JointDrawing::Organ> drawn;
  std::vector<std::vector<Eigen::Vector3d>> positions;
  for (const Organ& organ : organs_) positions.push_back(organ.drawn_positions());
  for (std::size_t o = 0; o < organs_.size(); ++o)
    drawn.push_back(
        {organs_[o].shown(), positions[o], organs_[o].bundle.proxy, organs_[o].bundle.lighting});
  return use(drawn);
}

DrawReport Player::draw_organs(const View& view, const DrawOptions& options, Frame& frame) {
  return with_drawn_organs([&](const std::vector<JointDrawing::Organ>& drawn) {
    return joint_drawing_.draw(drawn, view, options, frame);
  });
}

void Player::draw_by(std::shared_ptr<OrganDrawing> drawing) {
  drawing_ = std::move(drawing);
  drawing_note_.clear();
}

bool Player::shows_pictures() const { return drawing_ && drawing_->shows_pictures(); }

std::optional<DrawReport> Player::draw_otherwise(const View& view, const DrawOptions& options,
                                                 Frame& frame) {
  return with_drawn_organs(
      [&](const std::vector<JointDrawing::Organ>& drawn) -> std::optional<DrawReport> {
        drawing_note_ = drawing_->refusal(drawn, view, options);
        if (!drawing_note_.empty()) return {};
        try {
          return drawing_->draw(drawn, view, options, frame);
        } catch (const GraphicsError& error) {
          drawing_note_ = error.what();
          drawing_.reset();
          return {};
        }
      });
}

}  // namespace organbake
