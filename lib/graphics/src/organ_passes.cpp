// SPDX-License-Identifier: Apache-2.0
// One organ's passes by OpenGL: its patches placed and splatted, its base layer, resolved and lit.
#include "organ_passes.h"

#include <algorithm>
#include <numeric>

namespace organbake {
namespace {

// What place.vert captures of a patch: three matrices column by column, and two vectors.
constexpr std::array<int, 11> kPlacedSizes = {3, 3, 3, 3, 3, 3, 3, 3, 3, 4, 4};
constexpr int kGuard_px = 64;  // kMostSplat: round the picture, so that no splat is lost there

// From now on into these targets, in which nothing is nearer than the farthest.
void begin_depths(const FramebufferName& framebuffer) {
  constexpr float kFarthest = 1;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  glClearBufferfv(GL_DEPTH, 0, &kFarthest);
}

void set_scope_light(const Program& program, const ScopeShading& s, const SkinFinish& finish) {
  program.set("hill_phase", s.hill_phase);
  program.set("hill_slope", s.hill_slope);
  program.set("hill_variance", s.hill_variance);
  program.set("drops", s.drops);
  program.set("film", s.film);
  program.set("sheen", s.sheen);
  program.set("scope_light", s.light);
  program.set("scope_forward", s.forward);
  program.set("scope", s.scope);
  program.set("softness", Eigen::Vector3f(finish.softness.cast<float>()));
  program.set("grain", Eigen::Vector3f(finish.grain.cast<float>()));
  program.set("rim", static_cast<float>(finish.rim));
  program.set("grain_mm", static_cast<float>(finish.grain_mm));
}

// The light that an organ is drawn in, for the shaders (light.glsl); reference_mm: of full
// exposure.
void set_light(const Program& program, const PlacedOrgan& organ, const View& view,
               double reference_mm) {
  program.set("light", static_cast<int>(organ.light));
  if (organ.light == DrawnLight::baked) return;
  const Lighting& lighting = *organ.source.lighting;
  program.set("world_from_view",
              Eigen::Matrix3f(view.camera.camera_from_world.rotation.transpose().cast<float>()));
  program.set("above", Eigen::Vector3f(lighting.ambient_above.cast<float>()));
  program.set("below", Eigen::Vector3f(lighting.ambient_below.cast<float>()));
  program.set("up", Eigen::Vector3f(lighting.up.cast<float>()));
  constexpr std::size_t kMostLamps = 16, kMostLobes = 4;  // that a bundle may have
  const auto first_of = [](const auto& all, std::size_t most) {
    return std::span(all).first(std::min(most, all.size()));
  };
  std::vector<Eigen::Vector3f> toward, color;
  for (const Lighting::Lamp& lamp : first_of(lighting.lamps, kMostLamps)) {
    toward.push_back(lamp.toward.cast<float>());
    color.push_back(lamp.color.cast<float>());
  }
  std::vector<Eigen::Vector2f> lobes;
  for (const Lighting::Lobe& lobe : first_of(lighting.gloss, kMostLobes))
    lobes.emplace_back(float(lobe.strength), float(lobe.exponent));
  program.set("lamps", static_cast<int>(toward.size()));
  program.set("lamp_toward", toward);
  program.set("lamp_color", color);
  program.set("lobes", static_cast<int>(lobes.size()));
  program.set("lobe", lobes);
  if (organ.light == DrawnLight::scope)
    set_scope_light(program, organ.organ->warper.scope_shading(view, reference_mm),
                    lighting.finish);
}

// Takes what a view needs of an organ into its tables.
PlacedOrgan taken(const JointDrawing::Organ& organ, const View& view, const DrawOptions& options,
                  OrganTables& tables) {
  const DrawnLight light =
      organ.warper.can_relight() ? options.light.value_or(DrawnLight::baked) : DrawnLight::baked;
  const bool lit = light != DrawnLight::baked;
  PlacedOrgan placed{&organ, organ.warper.pose(organ.positions_mm, lit, options.folds), &tables};
  placed.light = light;
  placed.weights = drawn_shares(placed.source.manifold, view);
  tables.pose(placed.source, organ.positions_mm, lit);
  double sum = 0, shares = 0;  // of texels' sizes: ActiveCameras::texel_mm()
  for (int i = 0; i < Targets::kLayers; ++i) {
    const auto share = static_cast<float>(placed.weights.weights[i]);
    if (!(share > 0)) continue;
    const SampleTable& samples = tables.samples(organ.warper, placed.weights.cameras[i]);
    placed.layers.push_back({&samples, share});
    if (samples.patches > 0) sum += double(share) * samples.texel_mm, shares += share;
  }
  placed.texel_mm = shares > 0 ? sum / shares : 1;
  return placed;
}

PictureScale scale_of(const std::vector<PlacedOrgan>& organs, const View& view) {
  PictureScale scale;
  if (organs.size() == 1 && organs[0].source.lighting)
    scale.fade_px = organs[0].source.lighting->finish.border_fade_px(view.camera.intrinsics.fx);
  for (const PlacedOrgan& organ : organs) {
    const Bounds& rest = organ.source.at_rest;
    const double away = (view.camera.center_world_mm() - rest.center()).norm();
    scale.reach_mm = std::max(scale.reach_mm, static_cast<float>(away + rest.diagonal()));
    scale.texel_mm = std::max(scale.texel_mm, static_cast<float>(organ.texel_mm));
    scale.relit |= organ.light != DrawnLight::baked;
    if (organ.light == DrawnLight::scope && !scale.scope_light_mm)
      scale.scope_light_mm =
          organ.source.lighting->scope.value_or(ScopeLight()).offset_mm.cast<float>();
  }
  return scale;
}

}  // namespace

void OrganPasses::PlacedPatches::reserve(int patches) {
  if (patches <= room) return;
  room = patches;
  const int stride = std::accumulate(kPlacedSizes.begin(), kPlacedSizes.end(), 0) * 4;  // bytes
  glBindVertexArray(array.name());
  glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr{stride} * room, nullptr, GL_DYNAMIC_COPY);
  std::uintptr_t at = 0;
  for (unsigned i = 0; i < kPlacedSizes.size(); at += 4 * kPlacedSizes[i++]) {
    glEnableVertexAttribArray(i);
    glVertexAttribPointer(i, kPlacedSizes[i], GL_FLOAT, GL_FALSE, stride,
                          reinterpret_cast<const void*>(at));
    glVertexAttribDivisor(i, 1);
  }
  glBindBuffer(GL_ARRAY_BUFFER, 0);
}

OrganPasses::OrganPasses(const Programs& programs) : programs_(programs) {
  std::array<float, 2> sizes{};
  glGetFloatv(GL_ALIASED_POINT_SIZE_RANGE, sizes.data());
  if (sizes[1] < kGuard_px)
    throw GraphicsError("this graphics hardware draws no points as large as " +
                        std::to_string(kGuard_px) + " pixels");
  glBindTexture(GL_TEXTURE_3D, noise_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_R8I, kGrainSide, kGrainSide, kGrainSide, 0, GL_RED_INTEGER,
               GL_BYTE, grain_noise().data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  set_nearest(GL_TEXTURE_3D);
}

const Targets& OrganPasses::draw(const std::vector<JointDrawing::Organ>& all, const View& view,
                                 const DrawOptions& options) {
  view.check();
  targets_.resize(view.camera.intrinsics.width, view.camera.intrinsics.height);
  organs_.clear();
  while (tables_.size() > all.size()) tables_.pop_back();
  while (tables_.size() < all.size()) tables_.emplace_back();
  for (std::size_t o = 0; o < all.size(); ++o)
    organs_.push_back(taken(all[o], view, options, tables_[o]));
  scale_ = scale_of(organs_, view);
  begin(options);
  const double reference_mm = metered_mm(all, view, options);
  for (const PlacedOrgan& organ : organs_) {
    const bool has_base = organ.tables->steps > 0;
    place_patches(organ, view);
    splat_layers(organ, view, has_base);
    if (has_base) draw_base(organ, view);
    resolve_layers(organ, view, reference_mm);
  }
  return targets_;
}

void OrganPasses::begin(const DrawOptions& options) {
  glBindVertexArray(nothing_.name());
  glDisable(GL_CULL_FACE), glDisable(GL_SCISSOR_TEST), glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE), glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  if (is_desktop_gl()) glEnable(kProgramPointSize);
  begin_depths(targets_.resolved.framebuffer);
  const auto& [red, green, blue] = options.background;
  const std::array<float, 4> background = {red / 255.0f, green / 255.0f, blue / 255.0f, 0};
  glClearBufferfv(GL_COLOR, 0, background.data());
}

// With all that several passes ask for; each takes what it knows.
const Program& OrganPasses::begin_pass(const char* name, const PlacedOrgan& organ,
                                       const View& view) const {
  const Program& program = programs_.use(name);
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  const auto& [cameras, shares] = organ.weights;
  program.set("active_cameras", Eigen::Vector3i(cameras[0], cameras[1], cameras[2]));
  program.set("active_shares", Eigen::Vector3f(Eigen::Vector3d(shares.data()).cast<float>()));
  program.set("rotation", Eigen::Matrix3f(pose.rotation.cast<float>()));
  program.set("translation", Eigen::Vector3f((pose * organ.tables->origin).cast<float>()));
  program.set("lens", lens_of(k));
  program.set("picture", Eigen::Vector2f(float(k.width), float(k.height)));
  program.set("near_mm", static_cast<float>(view.near_mm));
  program.set("texel_mm", static_cast<float>(organ.texel_mm));
  program.set("reach", scale_.reach_mm);
  program.set("inverse_reach", 1 / scale_.reach_mm);
  program.set("layers", int(organ.layers.size()));
  program.set_texture("depths", GL_TEXTURE_2D_ARRAY, targets_.depths.texture());
  organ.tables->bind(program);
  return program;
}

void OrganPasses::place_patches(const PlacedOrgan& organ, const View& view) {
  const Program& place = begin_pass("place", organ, view);
  glEnable(GL_RASTERIZER_DISCARD);
  for (std::size_t l = 0; l < organ.layers.size(); ++l) {
    const SampleTable& samples = *organ.layers[l].samples;
    if (samples.patches == 0) continue;
    placed_[l].reserve(samples.patches);
    glBindVertexArray(nothing_.name());
    place.set_texture("samples", GL_TEXTURE_2D, samples.table.texture());
    place.set("first_patch", samples.first_patch);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, placed_[l].buffer.name());
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, samples.patches);
    glEndTransformFeedback();
  }
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
  glDisable(GL_RASTERIZER_DISCARD);
}

void OrganPasses::splat_layers(const PlacedOrgan& organ, const View& view, bool skip_nearest) {
  glDepthFunc(GL_LESS);
  glViewport(-kGuard_px, -kGuard_px, targets_.width + 2 * kGuard_px,
             targets_.height + 2 * kGuard_px);
  const Program& splat = begin_pass("splat", organ, view);
  splat.set("skip_nearest", int(skip_nearest));
  for (std::size_t l = 0; l < organ.layers.size(); ++l) {
    const SampleTable& samples = *organ.layers[l].samples;
    begin_depths(targets_.layers[l]);
    if (samples.patches == 0) continue;
    splat.set_texture("samples", GL_TEXTURE_2D, samples.table.texture());
    glBindVertexArray(placed_[l].array.name());
    glDrawArraysInstanced(GL_POINTS, 0, kChunk, samples.patches);
  }
  glBindVertexArray(nothing_.name());
  glViewport(0, 0, targets_.width, targets_.height);
}

void OrganPasses::draw_base(const PlacedOrgan& organ, const View& view) {
  begin_depths(targets_.base.framebuffer);
  begin_pass("base", organ, view).set("cut", int(organ.source.cut));
  const int steps = organ.tables->steps;
  glDrawArrays(GL_TRIANGLES, 0, 3 * steps * steps * organ.tables->faces);
}

void OrganPasses::resolve_layers(const PlacedOrgan& organ, const View& view, double reference_mm) {
  glBindFramebuffer(GL_FRAMEBUFFER, targets_.resolved.framebuffer.name());
  const Program& resolve = begin_pass("resolve", organ, view);
  Eigen::Vector3i first_patch(0, 0, 0), first_color(0, 0, 0), by_share(0, 1, 2);
  Eigen::Vector3f shares = Eigen::Vector3f::Zero();
  for (std::size_t l = 0; l < Targets::kLayers && !organ.layers.empty(); ++l) {
    const Layer& layer = organ.layers[l < organ.layers.size() ? l : 0];
    resolve.set_texture("samples" + std::to_string(l), GL_TEXTURE_2D,
                        layer.samples->table.texture());
    first_patch[l] = layer.samples->first_patch, first_color[l] = layer.samples->first_color;
    shares[l] = layer.share;
  }
  // Of equal shares the first layer comes last, and stands: leading_layer().
  std::sort(by_share.data(), by_share.data() + organ.layers.size(),
            [&](int a, int b) { return shares[a] != shares[b] ? shares[a] < shares[b] : a > b; });
  resolve.set_texture("noise", GL_TEXTURE_3D, noise_.name());
  set_light(resolve, organ, view, reference_mm);
  resolve.set_texture("keys", GL_TEXTURE_2D_ARRAY, targets_.keys.texture());
  resolve.set_texture("base_bound", GL_TEXTURE_2D, targets_.base.color.texture());
  resolve.set_texture("base_depth", GL_TEXTURE_2D, targets_.base.depth.texture());
  resolve.set("first_patch", first_patch);
  resolve.set("first_color", first_color);
  resolve.set("shares", shares);
  resolve.set("by_share", by_share);
  resolve.set("base_drawn", int(organ.tables->steps > 0));
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

bool OrganPasses::shows(const std::vector<JointDrawing::Organ>& all) const {
  return std::equal(all.begin(), all.end(), organs_.begin(), organs_.end(),
                    [](const JointDrawing::Organ& organ, const PlacedOrgan& placed) {
                      return placed.tables->shows(organ.warper.id(), organ.positions_mm);
                    });
}

}  // namespace organbake
