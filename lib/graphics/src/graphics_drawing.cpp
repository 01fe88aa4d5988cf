// SPDX-License-Identifier: Apache-2.0
#include "organbake/graphics/graphics_drawing.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>

#include "finishing.h"
#include "organ_tables.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"
#include "organbake/warp/camera_shares.h"
#include "skin_light.h"
#include "targets.h"

namespace organbake {
namespace {

constexpr int kPlacedNumbers = 36;  // that place.vert captures of a patch
constexpr int kGuard_px = 64;       // kMostSplat: round the picture, so that no splat is lost there

ShaderDialect dialect_of_context() {
  current_graphics_device();
  return epoxy_is_desktop_gl() ? ShaderDialect::desktop : ShaderDialect::embedded;
}

// Patches as place.vert captured them, and how splat.vert reads them.
struct PlacedPatches {
  BufferName buffer;
  VertexArrayName array;
  int room = 0;

  void reserve(int patches) {
    if (patches <= room) return;
    room = patches;
    constexpr GLsizei kStride = kPlacedNumbers * sizeof(float);
    glBindVertexArray(array.name());
    glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
    glBufferData(GL_ARRAY_BUFFER, GLsizeiptr{kStride} * room, nullptr, GL_DYNAMIC_COPY);
    for (unsigned i = 0; i < kPlacedNumbers / 4; ++i) {
      glEnableVertexAttribArray(i);
      glVertexAttribPointer(i, 4, GL_FLOAT, GL_FALSE, kStride,
                            reinterpret_cast<const void*>(std::uintptr_t{16} * i));
      glVertexAttribDivisor(i, 1);
    }
    glBindBuffer(GL_ARRAY_BUFFER, 0);
  }
};

// A camera of a view, and its share there.
struct Layer {
  const SampleTable* samples = nullptr;
  float share = 0;
};

// An organ in one picture.
struct PlacedOrgan {
  const JointDrawing::Organ* organ;
  OrganSource source;
  OrganTables* tables;
  ViewWeights weights;
  std::array<Layer, Targets::kLayers> layers;
  int layer_count = 0;
  DrawnLight light = DrawnLight::baked;
  double texel_mm = 1;

  // As ActiveCameras::texel_mm().
  void measure_texels() {
    double sum = 0, shares = 0;
    for (int l = 0; l < layer_count; ++l) {
      if (layers[l].samples->patches == 0) continue;
      sum += double(layers[l].share) * layers[l].samples->texel_mm;
      shares += layers[l].share;
    }
    texel_mm = shares > 0 ? sum / shares : 1;
  }
};

// As a new context is, for who draws in it next.
void leave_context() {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glBindVertexArray(0);
  glUseProgram(0);
  glBindTexture(GL_TEXTURE_2D, 0);
  glDisable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
}

void throw_errors() {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw GraphicsError(error == GL_OUT_OF_MEMORY
                          ? "the graphics hardware has not enough memory for this picture"
                          : "the graphics driver failed (error " + std::to_string(error) + ")");
}

}  // namespace

GraphicsDevice current_graphics_device() {
  const auto text = [](GLenum name) {
    const auto* words = reinterpret_cast<const char*>(glGetString(name));
    return std::string(words ? words : "");
  };
  const std::string name = text(GL_RENDERER);
  if (name.empty()) throw GraphicsError("no context of OpenGL is current");
  const int version = epoxy_gl_version();
  if (version < (epoxy_is_desktop_gl() ? 33 : 30))
    throw GraphicsError("drawing with graphics hardware needs OpenGL 3.3 or OpenGL ES 3.0, and '" +
                        name + "' has " + std::to_string(version / 10) + "." +
                        std::to_string(version % 10));
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  return {name, has("llvmpipe") || has("softpipe") || has("SwiftShader") || has("Software") ||
                    has("Basic Render")};
}

struct GraphicsDrawing::Impl {
  ShaderDialect dialect = dialect_of_context();
  Program place{dialect, files_of("place")}, reduce{dialect, files_of("reduce")},
      splat{dialect, files_of("splat")}, base{dialect, files_of("base")},
      resolve{dialect, files_of("resolve")};
  Finishing finishing{dialect};
  VertexArrayName nothing;  // for what is drawn by its vertices' numbers
  std::array<PlacedPatches, Targets::kLayers> placed;
  Targets targets;
  Stretches stretches;
  SkinLightUniforms skin_light;
  std::vector<OrganTables> tables;
  std::vector<PlacedOrgan> organs;  // of the last picture
  std::vector<std::uint8_t> pixels;
  std::vector<float> depths;

  Impl() {
    std::array<float, 2> sizes{};
    glGetFloatv(GL_ALIASED_POINT_SIZE_RANGE, sizes.data());
    if (sizes[1] < kGuard_px)
      throw GraphicsError("this graphics hardware draws no points as large as " +
                          std::to_string(kGuard_px) + " pixels");
  }

  const Targets::Picture& draw(const std::vector<JointDrawing::Organ>& all, const View& view,
                               const DrawOptions& options);
  DrawReport report() const;
  void read(const DrawOptions& options, const Targets::Picture& picture, Frame& frame,
            DrawReport& report);
  // Whether the frame still holds the last picture, and that is this one.
  bool holds(const std::vector<JointDrawing::Organ>& all, const View& view,
             const DrawOptions& options, const Frame& frame) const;
  void remember(const View& view, const DrawOptions& options, const DrawReport& report,
                Frame& frame);

  View last_view;
  DrawOptions last_options;
  DrawReport last_report;
  std::uint64_t last_serial = 0;  // of the frame that holds it
  bool agreed = true;             // with the processor, or that was not asked

 private:
  PlacedOrgan take(const JointDrawing::Organ& organ, const View& view, const DrawOptions& options);
  OrganTables& tables_of(const OrganSource& source);
  void set_view(const Program& program, const PlacedOrgan& organ, const View& view) const;
  void draw_organ(const PlacedOrgan& organ, const View& view, const DrawOptions& options,
                  double reference_mm);
  void place_patches(const PlacedOrgan& organ, const View& view);
  void splat_layers(const PlacedOrgan& organ, const View& view, bool skip_nearest);
  void draw_base(const PlacedOrgan& organ, const View& view);
  void resolve_layers(const PlacedOrgan& organ, const View& view, const DrawOptions& options,
                      double reference_mm);

  PictureScale scale_;
};

OrganTables& GraphicsDrawing::Impl::tables_of(const OrganSource& source) {
  for (OrganTables& one : tables)
    if (one.id() == source.id) return one;
  return tables.emplace_back(source);
}

PlacedOrgan GraphicsDrawing::Impl::take(const JointDrawing::Organ& organ, const View& view,
                                        const DrawOptions& options) {
  const DrawnLight light = organ.warper.can_relight() ? options.light : DrawnLight::baked;
  const bool lit = light != DrawnLight::baked;
  PlacedOrgan placed{.organ = &organ,
                     .source = organ.warper.pose(organ.positions_mm, lit),
                     .tables = nullptr,
                     .weights = {},
                     .layers = {},
                     .light = light};
  OrganTables& own = tables_of(placed.source);
  placed.weights = drawn_shares(placed.source.manifold, view);
  own.pose(placed.source, organ.positions_mm, lit);
  for (int i = 0; i < Targets::kLayers; ++i) {
    if (placed.weights.weights[i] <= 0) continue;
    placed.layers[placed.layer_count++] = {&own.samples(organ.warper, placed.weights.cameras[i]),
                                           static_cast<float>(placed.weights.weights[i])};
  }
  placed.measure_texels();
  return placed;
}

const Targets::Picture& GraphicsDrawing::Impl::draw(const std::vector<JointDrawing::Organ>& all,
                                                    const View& view, const DrawOptions& options) {
  view.check();
  targets.resize(view.camera.intrinsics.width, view.camera.intrinsics.height);
  organs.clear();
  for (const JointDrawing::Organ& organ : all) organs.push_back(take(organ, view, options));
  std::erase_if(tables, [&](const OrganTables& one) {
    return std::none_of(organs.begin(), organs.end(),
                        [&](const PlacedOrgan& organ) { return organ.source.id == one.id(); });
  });
  scale_ = {};
  scale_.reach_mm = scale_.texel_mm = 0;
  if (organs.size() == 1 && organs[0].source.lighting)
    scale_.fade_px = organs[0].source.lighting->finish.border_fade_px(view.camera.intrinsics.fx);
  for (PlacedOrgan& organ : organs) {
    organ.tables = &tables_of(organ.source);
    const Bounds& rest = organ.source.at_rest;
    const double away = (view.camera.center_world_mm() - rest.center()).norm();
    scale_.reach_mm = std::max(scale_.reach_mm, static_cast<float>(away + rest.diagonal()));
    scale_.texel_mm = std::max(scale_.texel_mm, static_cast<float>(organ.texel_mm));
    if (organ.light == DrawnLight::scope && !scale_.scope_light_mm)
      scale_.scope_light_mm =
          organ.source.lighting->scope.value_or(ScopeLight()).offset_mm.cast<float>();
  }
  glBindVertexArray(nothing.name());
  glDisable(GL_CULL_FACE), glDisable(GL_SCISSOR_TEST), glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE), glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  if (dialect == ShaderDialect::desktop) glEnable(GL_PROGRAM_POINT_SIZE);
  glBindFramebuffer(GL_FRAMEBUFFER, targets.resolved.framebuffer.name());
  const auto& [red, green, blue] = options.background;
  const std::array<float, 4> background = {red / 255.0f, green / 255.0f, blue / 255.0f, 0};
  constexpr float kFarthest = 1;
  glClearBufferfv(GL_COLOR, 0, background.data());
  glClearBufferfv(GL_DEPTH, 0, &kFarthest);
  const double reference_mm = metered_mm(all, view, options);
  for (const PlacedOrgan& organ : organs) draw_organ(organ, view, options, reference_mm);
  return finishing.apply(view, options, scale_, targets);
}

void GraphicsDrawing::Impl::draw_organ(const PlacedOrgan& organ, const View& view,
                                       const DrawOptions& options, double reference_mm) {
  const bool has_base = options.base_layer && organ.tables->steps() > 0;
  place_patches(organ, view);
  splat_layers(organ, view, has_base);
  if (has_base) draw_base(organ, view);
  resolve_layers(organ, view, options, reference_mm);
}

void GraphicsDrawing::Impl::set_view(const Program& program, const PlacedOrgan& organ,
                                     const View& view) const {
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  program.set("rotation", Eigen::Matrix3f(pose.rotation.cast<float>()));
  program.set("translation", Eigen::Vector3f((pose * organ.tables->origin()).cast<float>()));
  program.set("lens", Eigen::Vector4f(Eigen::Vector4d(k.fx, k.fy, k.cx, k.cy).cast<float>()));
  program.set("picture", Eigen::Vector2f(float(k.width), float(k.height)));
  program.set("near_mm", static_cast<float>(view.near_mm));
  organ.tables->bind_shell(program);
}

void GraphicsDrawing::Impl::place_patches(const PlacedOrgan& organ, const View& view) {
  stretches.resize(organ.tables->faces());
  stretches.begin();
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendEquation(GL_MAX);
  place.use();
  set_view(place, organ, view);
  place.set("face_table", Eigen::Vector2f(float(Table::kColumns), float(stretches.rows())));
  for (int l = 0; l < organ.layer_count; ++l) {
    const SampleTable& samples = *organ.layers[l].samples;
    if (samples.patches == 0) continue;
    placed[l].reserve(samples.patches);
    glBindVertexArray(nothing.name());
    place.set_texture("samples", GL_TEXTURE_2D, samples.table.texture());
    place.set("first_patch", samples.first_patch);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, placed[l].buffer.name());
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, samples.patches);
    glEndTransformFeedback();
  }
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
  glBlendEquation(GL_FUNC_ADD);
  glDisable(GL_BLEND);
  glBindVertexArray(nothing.name());
  stretches.reduce(reduce);
  glEnable(GL_DEPTH_TEST);
}

void GraphicsDrawing::Impl::splat_layers(const PlacedOrgan& organ, const View& view,
                                         bool skip_nearest) {
  constexpr float kFarthest = 1;
  glDepthFunc(GL_LESS);
  glViewport(-kGuard_px, -kGuard_px, targets.width + 2 * kGuard_px, targets.height + 2 * kGuard_px);
  splat.use();
  splat.set("picture", Eigen::Vector2f(float(targets.width), float(targets.height)));
  splat.set("near_mm", static_cast<float>(view.near_mm));
  splat.set("skip_nearest", int(skip_nearest));
  splat.set("texel_mm", static_cast<float>(organ.texel_mm));
  splat.set("inverse_reach", 1 / scale_.reach_mm);
  for (int l = 0; l < organ.layer_count; ++l) {
    const SampleTable& samples = *organ.layers[l].samples;
    glBindFramebuffer(GL_FRAMEBUFFER, targets.layers[l].name());
    glClearBufferfv(GL_DEPTH, 0, &kFarthest);
    if (samples.patches == 0) continue;
    splat.set_texture("samples", GL_TEXTURE_2D, samples.table.texture());
    glBindVertexArray(placed[l].array.name());
    glDrawArraysInstanced(GL_POINTS, 0, SampleSource::kSlots, samples.patches);
  }
  glBindVertexArray(nothing.name());
  glViewport(0, 0, targets.width, targets.height);
}

namespace {

void set_active(const Program& program, const PlacedOrgan& organ) {
  constexpr std::uint32_t kUnseen = 32;  // the base layer knows of the first 32 cameras
  std::array<std::uint32_t, 3> cameras{};
  Eigen::Vector3f shares;
  for (int i = 0; i < 3; ++i) {
    cameras[i] = std::min(organ.weights.cameras[i], kUnseen);
    shares[i] = static_cast<float>(organ.weights.weights[i]);
  }
  program.set("active_cameras", cameras);
  program.set("active_shares", shares);
}

}  // namespace

void GraphicsDrawing::Impl::draw_base(const PlacedOrgan& organ, const View& view) {
  constexpr float kFarthest = 1;
  glBindFramebuffer(GL_FRAMEBUFFER, targets.base.name());
  glClearBufferfv(GL_DEPTH, 0, &kFarthest);
  base.use();
  set_view(base, organ, view);
  set_active(base, organ);
  organ.tables->bind_nodes(base);
  base.set_texture("stretches", GL_TEXTURE_2D, stretches.table());
  base.set_texture("largest_stretch", GL_TEXTURE_2D, stretches.largest());
  base.set_texture("depths", GL_TEXTURE_2D_ARRAY, targets.depths.texture());
  base.set("layers", organ.layer_count);
  base.set("cut", int(organ.source.cut));
  base.set("inverse_reach", 1 / scale_.reach_mm);
  const int steps = organ.tables->steps();
  glDrawArrays(GL_TRIANGLES, 0, 3 * steps * steps * organ.tables->faces());
}

void GraphicsDrawing::Impl::resolve_layers(const PlacedOrgan& organ, const View& view,
                                           const DrawOptions& options, double reference_mm) {
  glBindFramebuffer(GL_FRAMEBUFFER, targets.resolved.framebuffer.name());
  resolve.use();
  std::array<int, 3> first_patch{}, first_smooth{}, by_share = {0, 1, 2};
  Eigen::Vector3f shares = Eigen::Vector3f::Zero();
  constexpr std::array<const char*, 3> kSamples = {"samples0", "samples1", "samples2"};
  for (int l = 0; l < Targets::kLayers; ++l) {
    const Layer& layer = organ.layers[l < organ.layer_count ? l : 0];
    if (!layer.samples) continue;
    resolve.set_texture(kSamples[l], GL_TEXTURE_2D, layer.samples->table.texture());
    first_patch[l] = layer.samples->first_patch, first_smooth[l] = layer.samples->first_smooth;
    shares[l] = layer.share;
  }
  // Of equal shares the first layer comes last, and stands: DominantSamples.
  std::sort(by_share.begin(), by_share.begin() + organ.layer_count,
            [&](int a, int b) { return shares[a] != shares[b] ? shares[a] < shares[b] : a > b; });
  set_active(resolve, organ);
  organ.tables->bind_nodes(resolve);
  skin_light.set(resolve, organ.organ->warper, organ.source.lighting, view, organ.light,
                 reference_mm);
  resolve.set_texture("keys", GL_TEXTURE_2D_ARRAY, targets.keys.texture());
  resolve.set_texture("depths", GL_TEXTURE_2D_ARRAY, targets.depths.texture());
  resolve.set_texture("base_bound", GL_TEXTURE_2D, targets.base_bound.texture());
  resolve.set_texture("base_depth", GL_TEXTURE_2D, targets.base_depth.texture());
  resolve.set_texture("largest_stretch", GL_TEXTURE_2D, stretches.largest());
  resolve.set("first_patch", first_patch);
  resolve.set("first_smooth", first_smooth);
  resolve.set("shares", shares);
  resolve.set("by_share", by_share);
  resolve.set("layers", organ.layer_count);
  const Lighting* lighting = organ.source.lighting;
  resolve.set("smooth_colors",
              int(organ.light == DrawnLight::scope && lighting && lighting->scope.has_value()));
  resolve.set("base_drawn", int(options.base_layer && organ.tables->steps() > 0));
  resolve.set("reach", scale_.reach_mm);
  resolve.set("texel_mm", static_cast<float>(organ.texel_mm));
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

bool GraphicsDrawing::Impl::holds(const std::vector<JointDrawing::Organ>& all, const View& view,
                                  const DrawOptions& options, const Frame& frame) const {
  if (frame.serial == 0 || frame.serial != last_serial) return false;
  if (!(view == last_view) || !(options == last_options) || all.size() != organs.size())
    return false;
  for (std::size_t o = 0; o < all.size(); ++o) {
    const auto same = [&](const OrganTables& one) { return one.id() == all[o].warper.id(); };
    const auto found = std::find_if(tables.begin(), tables.end(), same);
    if (organs[o].source.id != all[o].warper.id() || found == tables.end() ||
        !found->is_posed(all[o].positions_mm))
      return false;
  }
  return true;
}

// Serials of the processor's frames begin at 1.
void GraphicsDrawing::Impl::remember(const View& view, const DrawOptions& options,
                                     const DrawReport& report, Frame& frame) {
  static std::atomic<std::uint64_t> next{std::uint64_t{1} << 63};
  last_view = view, last_options = options, last_report = report;
  frame.serial = last_serial = ++next;
}

DrawReport GraphicsDrawing::Impl::report() const {
  DrawReport report;
  report.weights = organs.front().weights;
  for (const PlacedOrgan& organ : organs)
    report.texel_mm = std::max(report.texel_mm, static_cast<float>(organ.texel_mm));
  return report;
}

void GraphicsDrawing::Impl::read(const DrawOptions& options, const Targets::Picture& picture,
                                 Frame& frame, DrawReport& report) {
  const std::size_t count = std::size_t(targets.width) * targets.height;
  frame.serial = 0;
  frame.color.width = targets.width, frame.color.height = targets.height;
  frame.color.pixels.resize(3 * count);
  frame.cover.resize(count);
  frame.depth_mm.resize(options.keep_depth ? count : 0);
  frame.shown.clear(), frame.bound.clear(), frame.organ.clear();
  pixels.resize(4 * count);
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer.name());
  glReadPixels(0, 0, targets.width, targets.height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  for (std::size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) frame.color.pixels[3 * i + c] = pixels[4 * i + c];
    frame.cover[i] = static_cast<Cover>(pixels[4 * i + 3]);
    report.sample_pixels += frame.cover[i] == Cover::samples;
    report.base_pixels += frame.cover[i] == Cover::base;
  }
  if (!options.keep_depth) return;
  glReadPixels(0, 0, targets.width, targets.height, GL_DEPTH_COMPONENT, GL_FLOAT,
               frame.depth_mm.data());
  for (float& depth : frame.depth_mm)
    depth = depth < 1 ? depth * scale_.reach_mm : std::numeric_limits<float>::infinity();
}

GraphicsDrawing::GraphicsDrawing(FirstPicture first) : impl_(std::make_unique<Impl>()) {
  impl_->agreed = first == FirstPicture::trusted;
  throw_errors();
}
GraphicsDrawing::~GraphicsDrawing() = default;

std::string GraphicsDrawing::refusal(const std::vector<JointDrawing::Organ>&, const View&,
                                     const DrawOptions& options) const {
  if (options.keep_shown || options.keep_bound)
    return "it does not tell what skin each pixel shows, which layers of truth ask for";
  if (options.keep_depth && impl_->dialect == ShaderDialect::embedded)
    return "by OpenGL ES it tells no depth";
  return {};
}

unsigned GraphicsDrawing::draw_to_texture(const std::vector<JointDrawing::Organ>& organs,
                                          const View& view, const DrawOptions& options) {
  const unsigned texture = impl_->draw(organs, view, options).color.texture();
  leave_context();
  throw_errors();
  return texture;
}

DrawReport GraphicsDrawing::draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                                 const DrawOptions& options, Frame& frame) {
  if (impl_->holds(organs, view, options, frame)) {
    DrawReport report = impl_->last_report;
    report.unchanged = true;
    report.times = report.critical_path = {};
    return report;
  }
  Stopwatch watch;
  const Targets::Picture& picture = impl_->draw(organs, view, options);
  DrawReport report = impl_->report();
  impl_->read(options, picture, frame, report);
  leave_context();
  throw_errors();
  if (options.measure) report.times.resolve = report.critical_path.resolve = watch.lap();
  impl_->remember(view, options, report, frame);
  if (!impl_->agreed) check_agreement(organs, view, options, frame);
  return report;
}

// As the processor draws it.
void GraphicsDrawing::check_agreement(const std::vector<JointDrawing::Organ>& organs,
                                      const View& view, const DrawOptions& options,
                                      const Frame& frame) {
  Frame reference;
  JointDrawing().draw(organs, view, options, reference);
  const double psnr_db = compare_images(reference.color, frame.color).psnr_db;
  if (psnr_db < kLeastAgreement_db)
    throw GraphicsError("the graphics hardware's picture is not the processor's: they agree to " +
                        to_text(psnr_db, 1) + " dB, less than " + to_text(kLeastAgreement_db, 0));
  impl_->agreed = true;
}

std::size_t GraphicsDrawing::table_bytes() const {
  std::size_t sum = 0;
  for (const OrganTables& one : impl_->tables) sum += one.bytes();
  return sum;
}

}  // namespace organbake
