// SPDX-License-Identifier: Apache-2.0
#include "live_organ.h"

#include <wasm_simd128.h>

#include <algorithm>
#include <utility>

#include "organbake/bundle/stored_maps.h"
#include "organbake/core/error.h"
#include "organbake/graphics/graphics_drawing.h"
#include "organbake/player/orbit.h"
#include "organbake/player/script.h"

namespace organbake {
namespace {

constexpr double kAway_mm = 500, kPerMetre_mm = 1000;

RigidTransform in_mm(const Eigen::Matrix4d& metres) {
  return {metres.topLeftCorner<3, 3>(), kPerMetre_mm * metres.topRightCorner<3, 1>()};
}

// From y up and z backward to y down and z ahead, and back.
const RigidTransform kTurnedOver = {Eigen::Vector3d(1, -1, -1).asDiagonal()};

}  // namespace

void HeadsetEyes::place(const Eigen::Matrix4d& room_from_viewer, const View& page,
                        const Eigen::Vector3d& center_mm) {
  RigidTransform level = in_mm(room_from_viewer);
  // Looking straight up or down is no heading: any will do.
  Eigen::Vector3d backward = level.rotation.col(2);
  backward.y() = 0;
  if (backward.norm() < 1e-3) backward = Eigen::Vector3d::UnitZ();
  backward.normalize();
  level.rotation << backward.z(), 0, backward.x(), 0, 1, 0, -backward.x(), 0, backward.z();
  RigidTransform eye_from_world{page.camera.camera_from_world.rotation};
  eye_from_world.translation = Eigen::Vector3d(0, 0, kAway_mm) - eye_from_world * center_mm;
  room_from_world_ = level * kTurnedOver * eye_from_world;
}

View HeadsetEyes::view(const Eigen::Matrix4d& eye_from_room, const Eigen::Matrix4d& projection,
                       const Eigen::Vector2i& size) const {
  View view;
  view.camera.camera_from_world = kTurnedOver * in_mm(eye_from_room) * room_from_world_;
  const double half_width = 0.5 * size.x(), half_height = 0.5 * size.y();
  Intrinsics& lens = view.camera.intrinsics;
  lens.width = size.x(), lens.height = size.y();
  lens.fx = half_width * projection(0, 0), lens.fy = half_height * projection(1, 1);
  lens.cx = half_width * (1 - projection(0, 2)), lens.cy = half_height * (1 + projection(1, 2));
  return view;
}

namespace {

constexpr double kTimeStep_s = 1.0 / 60;

// Three bytes a pixel to the four that a page's canvas takes.
void to_rgba(const std::uint8_t* rgb, std::size_t pixels, std::uint8_t* rgba) {
  std::size_t i = 0;
  // Four at a time, which the compiler would move one by one; sixteen bytes are read for twelve.
  const v128_t bytes = wasm_i8x16_const(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1);
  const v128_t opaque = wasm_u32x4_const_splat(0xFF000000u);
  for (; i + 6 <= pixels; i += 4) {
    const v128_t four = wasm_i8x16_swizzle(wasm_v128_load(rgb + 3 * i), bytes);
    wasm_v128_store(rgba + 4 * i, wasm_v128_or(four, opaque));
  }
  for (; i < pixels; ++i) {
    for (int k = 0; k < 3; ++k) rgba[4 * i + k] = rgb[3 * i + k];
    rgba[4 * i + 3] = 255;
  }
}

}  // namespace

LiveOrgan::LiveOrgan(Bundle frame) : supplied_(frame.cameras.cameras.size()) {
  const auto read = [this, cameras = frame.cameras.cameras,
                     faces = shell_face_count(frame)](std::size_t c) {
    if (supplied_[c].empty()) throw MapsWanted{c};
    CameraMaps maps = decoded_maps(supplied_[c], cameras[c].intrinsics, faces,
                                   "the maps of camera " + std::to_string(c));
    supplied_[c] = {};
    return maps;
  };
  DeformOptions options;
  options.time_step_s = kTimeStep_s;
  player_ = std::make_unique<Player>(std::move(frame), read, options);
  session_ = std::make_unique<LiveSession>(*player_, kTimeStep_s);
  drawing_.light = player_->light_for();
}

void LiveOrgan::supply(std::size_t camera, std::vector<std::byte> maps) {
  if (camera >= supplied_.size()) throw UsageError("there is no camera " + std::to_string(camera));
  supplied_[camera] = std::move(maps);
}

bool LiveOrgan::bind_next() {
  all_bound_ = !player_->load_next();
  return !all_bound_;
}

bool LiveOrgan::touch(const Eigen::Vector2d& at_px, const InstrumentKind& kind) {
  if (has_blade(kind)) {
    if (!has_tetrahedra())
      throw UsageError("this organ cannot be cut: it was baked with --set mechanics.fem=false");
    if (!all_bound_) throw UsageError("all cameras must be loaded before the organ is cut");
    set_solver(TissueSolver::fem);
  }
  return session_->touch(at_px, kind);
}

void LiveOrgan::advance(bool step, int width, int height) {
  PlayOptions size;
  size.width = width, size.height = height;
  size.check();
  take(session_->advance(step, width, height, drawing_));
  if (!last_.draw.unchanged) inside_ = eye_inside();
  show(session_->frame());
}

void LiveOrgan::take(PlayedFrame played) {
  last_ = std::move(played);
  if (last_.step.recovered) ++recovered_;
}

void LiveOrgan::pass_time() { take(session_->pass_time(true)); }

void LiveOrgan::stand_before(const Eigen::Matrix4d& room_from_viewer) {
  eyes_.place(room_from_viewer, session_->view(),
              player_->bundle().cameras.manifold.center_world_mm);
}

void LiveOrgan::look(const Eigen::Matrix4d& eye_from_room, const Eigen::Matrix4d& projection,
                     const Eigen::Vector2i& size) {
  player_->draw(eyes_.view(eye_from_room, projection, size), session_->drawn(drawing_), eye_frame_);
  show(eye_frame_);
}

// Of a picture in a canvas nobody counts what it shows: whether the skin ahead is missing decides
// whether to look closer.
bool LiveOrgan::eye_inside() const {
  if (player_->shows_pictures() && session_->scope_distance_mm()) return false;
  return why_empty(*player_, session_->view(), last_.draw).has_value();
}

void LiveOrgan::show(const Frame& frame) {
  if (frame.serial != 0 && frame.serial == shown_) return;
  shown_ = frame.serial;
  const std::size_t pixels = frame.color.pixels.size() / 3;
  rgba_.resize(4 * pixels);
  to_rgba(frame.color.pixels.data(), pixels, rgba_.data());
}

int LiveOrgan::play(const std::string& text, int wanted) {
  const Script script = script_from_json(text, "the script");
  if (script.time_step_s != kTimeStep_s)
    throw UsageError("the script's time step is not the page's, a 60th of a second");
  set_solver(script.solver.value_or(usual_solver()));
  PlayOptions options;
  options.most_frames = std::max(1, wanted + 1);
  options.draw = drawing_;
  if (script.light) options.draw.light = *script.light;
  shown_ = 0;
  const int frames = options.frames_of(script);
  organbake::play(*player_, script, options, [&](int frame, const Frame& picture) {
    if (frame + 1 == frames) show(picture);
  });
  player_->set_cut_times(std::nullopt);  // a page has no thread to spare
  shown_ = 0;
  return frames;
}

void LiveOrgan::set_state(std::span<const float> xyz_mm, StateOf of) {
  of == StateOf::nodes ? player_->set_nodes(xyz_mm) : player_->set_vertices(xyz_mm);
}
void LiveOrgan::set_state(std::span<const double> xyz_mm, StateOf of) {
  of == StateOf::nodes ? player_->set_nodes(xyz_mm) : player_->set_vertices(xyz_mm);
}

void LiveOrgan::place_tools(const std::vector<EmbeddedPlayer::Tip>& tips) {
  std::vector<Instrument> instruments = instruments_from(tips);
  check_instruments(instruments);
  session_->place_tools(std::move(instruments));
}

std::vector<Eigen::Vector3d> LiveOrgan::contact_forces(const std::vector<EmbeddedPlayer::Tip>& tips,
                                                       bool on_nodes) {
  const auto forces = player_->contact_force_n(instruments_from(tips));
  return on_nodes ? forces_on_nodes(player_->bundle_now(), forces) : forces;
}

void LiveOrgan::set_solver(TissueSolver solver) {
  if (player_->solver() == solver) return;
  player_->set_solver(solver);
  session_->reset();
}

void LiveOrgan::reset() {
  if (player_->solver() == chosen_.value_or(usual_solver())) return session_->reset();
  set_solver(chosen_.value_or(usual_solver()));
}

void LiveOrgan::choose_solver(TissueSolver solver) {
  session_->set_solver(solver);
  chosen_ = solver;
}

std::string LiveOrgan::draw_by_graphics(bool software_too) {
  const GraphicsDevice device = current_graphics_device();
  if (device.software && !software_too)
    throw GraphicsError("'" + device.name + "' is software, not graphics hardware");
  player_->draw_by(std::make_shared<GraphicsDrawing>(GraphicsDrawing::FirstPicture::checked,
                                                     GraphicsDrawing::Pictures::shown));
  return device.name;
}

void LiveOrgan::set_background(int red, int green, int blue) {
  const auto byte = [](int level) { return static_cast<std::uint8_t>(std::clamp(level, 0, 255)); };
  drawing_.background = {byte(red), byte(green), byte(blue)};
}

std::span<const LiveOrgan::Figure> LiveOrgan::figures() {
  using Organ = const LiveOrgan&;
  static constexpr Figure kFigures[] = {
      {"stepMs", [](Organ o) { return o.last_.deform_ms; }},
      {"drawMs", [](Organ o) { return o.last_.draw_ms; }},
      {"forceN",  // on the held tool
       [](Organ o) {
         const auto& forces = o.last_.step.tip_force_n;
         return forces.empty() ? 0 : forces.back().norm();
       }},
      {"depthMm", [](Organ o) { return o.session_->depth_mm(); }},  // below the place it touched
      {"radius", [](Organ o) { return o.session_->tool_radius_mm(); }},
      {"light", [](Organ o) { return double(*o.drawing_.light); }},
      // How many there are: what was baked alone, or all.
      {"lights", [](Organ o) { return double(o.player_->can_relight() ? kLightNames.size() : 1); }},
      {"cameras", [](Organ o) { return double(o.supplied_.size()); }},
      {"proxyFaces", [](Organ o) { return double(o.player_->bundle().proxy.faces.size()); }},
      {"unchanged", [](Organ o) { return double(o.last_.draw.unchanged); }},
      {"recovered", [](Organ o) { return double(o.recovered_); }},  // from lost states, how often
      {"canCut", [](Organ o) { return double(o.has_tetrahedra()); }},
      {"pieces", [](Organ o) { return double(o.player_->piece_count()); }},
      {"solver", [](Organ o) { return double(o.player_->solver() == TissueSolver::fem); }},
      {"canUndo", [](Organ o) { return double(o.session_->can_undo()); }},
      {"canRedo", [](Organ o) { return double(o.session_->can_redo()); }},
      {"seeking", [](Organ o) { return double(o.session_->seeking()); }},
      // From the lens to the skin straight ahead; 0 where there is none.
      {"scopeMm", [](Organ o) { return o.session_->scope_distance_mm().value_or(0); }},
      {"viewAngle", [](Organ o) { return o.session_->view_angle_deg(); }},
      {"inside", [](Organ o) { return double(o.inside_); }},
      {"graphics", [](Organ o) { return double(o.player_->shows_pictures()); }}};
  return kFigures;
}

}  // namespace organbake
