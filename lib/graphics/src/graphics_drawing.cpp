// SPDX-License-Identifier: Apache-2.0
// Draws organs by OpenGL, and finishes the picture as lib/warp's finishing does.
#include "organbake/graphics/graphics_drawing.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "gl.h"
#include "organ_passes.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"
#include "organbake/warp/joint_drawing.h"
#include "organbake/warp/solids.h"

namespace organbake {
Finishing::Finishing(ShaderDialect dialect)
    : open_(dialect, files_of("open")),
      slits_(dialect, files_of("slits")),
      across_(dialect, files_of("across")),
      fade_(dialect, files_of("fade")),
      shadows_(dialect, files_of("shadows")),
      solids_(dialect, files_of("solids")),
      wounds_(dialect, files_of("wounds")),
      edges_(dialect, files_of("edges")),
      outline_(dialect, files_of("outline")) {}

const Targets::Picture& Finishing::apply(const View& view, const DrawOptions& options,
                                         PictureScale scale, Targets& targets) {
  last_ = &targets.resolved;
  glDepthFunc(GL_ALWAYS);
  fill_slits(scale, targets);
  if (options.smooth_outline && scale.fade_px > 1)
    fade_borders(scale.fade_px, options.background, targets);
  draw_blood(view, options.blood, scale, targets);
  if (!options.solids.empty()) draw_solids(view, options.solids, scale, targets);
  draw_smoke(view, options.smoke, scale, targets);
  if (options.smooth_outline) smooth_outlines(scale, targets);
  return *last_;
}

void Finishing::set_common(const Program& program, const Targets::Picture& from, Targets& targets) {
  program.use();
  program.set("picture", Eigen::Vector2f(float(targets.width), float(targets.height)));
  program.set_texture("colors", GL_TEXTURE_2D, from.color.texture());
  program.set_texture("depths", GL_TEXTURE_2D, from.depth.texture());
}

void Finishing::pass(const Program& program, Targets& targets) {
  set_common(program, *last_, targets);
  const Targets::Picture& to = targets.finished[next_];
  next_ = 1 - next_;
  glBindFramebuffer(GL_FRAMEBUFFER, to.framebuffer.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  last_ = &to;
}

void Finishing::fill_slits(PictureScale scale, Targets& targets) {
  open_.use();
  open_.set("texel", scale.texel_mm / scale.reach_mm);
  pass(open_, targets);
  for (const Eigen::Vector2i& back : {Eigen::Vector2i(0, -1), Eigen::Vector2i(-1, 0)}) {
    slits_.use();
    slits_.set("back", back);
    pass(slits_, targets);
  }
}

void Finishing::fade_borders(int width_px, const std::array<std::uint8_t, 3>& background,
                             Targets& targets) {
  set_common(across_, *last_, targets);
  across_.set("fade", width_px);
  glBindFramebuffer(GL_FRAMEBUFFER, targets.edge_picture.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  fade_.use();
  fade_.set_texture("across", GL_TEXTURE_2D, targets.edges.texture());
  fade_.set("fade", width_px);
  const auto& [red, green, blue] = background;
  fade_.set("background", Eigen::Vector3f(Eigen::Vector3f(red, green, blue) / 255));
  pass(fade_, targets);
}

// What a shader knows of a solid, a bead of blood or a puff of smoke.
struct Finishing::TableRows {
  struct Texel {
    Eigen::Vector3d place;
    double more = 0;
  };
  std::array<Texel, 4> texels;
};

void Finishing::pass_table(const Program& program, const View& view,
                           const std::vector<TableRows>& table, const PixelBox& box,
                           PictureScale scale, Targets& targets) {
  if (box.empty()) return;
  std::vector<float> numbers;
  for (const TableRows& rows : table)
    for (const auto& [at, more] : rows.texels)
      for (const double number : {at.x(), at.y(), at.z(), more})
        numbers.push_back(static_cast<float>(number));
  solid_table_.fill(numbers);
  program.use();
  program.set_texture("solids", GL_TEXTURE_2D, solid_table_.texture());
  program.set("solid_count", static_cast<int>(table.size()));
  program.set("solid_box",
              Eigen::Vector4f(float(box.x0), float(box.y0), float(box.x1), float(box.y1)));
  program.set("view_lens", lens_of(view.camera.intrinsics));
  program.set("near_mm", static_cast<float>(view.near_mm));
  program.set("reach", scale.reach_mm);
  program.set("at_scope", scale.scope_light_mm ? 1 : 0);
  program.set("light_mm", scale.scope_light_mm.value_or(Eigen::Vector3f::Zero()));
  pass(program, targets);
}

void Finishing::draw_solids(const View& view, const std::vector<Solid>& solids, PictureScale scale,
                            Targets& targets) {
  const auto box_round = [&](const std::vector<Solid>& all) {
    PixelBox box;
    for (const SolidBlock& block : solid_blocks(all, view)) box = united(box, block.box);
    return box;
  };
  const RigidTransform& pose = view.camera.camera_from_world;
  std::vector<TableRows> table;
  for (const Solid& solid : solids) {
    const Eigen::Vector3d third =
        solid.corner ? pose * *solid.corner : Eigen::Vector3d(pose.rotation * solid.pressed_mm);
    table.push_back({{{{pose * solid.from, solid.radius_mm},
                       {pose * solid.to, solid.corner ? 1.0 : 0.0},
                       {third},
                       {solid.color.cast<double>()}}}});
  }
  if (scale.relit)
    pass_table(shadows_, view, table, box_round(with_shadows(solids)), scale, targets);
  pass_table(solids_, view, table, box_round(solids), scale, targets);
}

void Finishing::draw_blood(const View& view, const std::vector<BloodLine>& blood,
                           PictureScale scale, Targets& targets) {
  const RigidTransform& pose = view.camera.camera_from_world;
  PixelBox box;
  std::vector<TableRows> table;
  for (const BloodLine& line : blood) {
    table.push_back({{{{pose * line.from_mm, line.from_radius_mm},
                       {pose * line.to_mm, line.to_radius_mm},
                       {pose.rotation * line.outward},
                       {pose.rotation * line.down_wall}}}});
    box = united(box, box_round(line, view));
  }
  wounds_.use();
  wounds_.set("smoke", 0);
  pass_table(wounds_, view, table, box, scale, targets);
}

void Finishing::draw_smoke(const View& view, const std::vector<SmokePuff>& smoke,
                           PictureScale scale, Targets& targets) {
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  PixelBox box;
  std::vector<TableRows> table;
  for (const SmokePuff& puff : smoke) {
    table.push_back({{{{view.camera.camera_from_world * puff.middle_mm, puff.radius_mm},
                       {none, puff.share},
                       {none},
                       {none}}}});
    box = united(box, box_round(puff, view));
  }
  wounds_.use();
  wounds_.set("smoke", 1);
  pass_table(wounds_, view, table, box, scale, targets);
}

void Finishing::smooth_outlines(PictureScale scale, Targets& targets) {
  set_common(edges_, *last_, targets);
  edges_.set("texel", scale.texel_mm / scale.reach_mm);
  edges_.set_texture("skin_depths", GL_TEXTURE_2D, targets.resolved.depth.texture());
  glBindFramebuffer(GL_FRAMEBUFFER, targets.edge_picture.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  outline_.use();
  outline_.set_texture("edges", GL_TEXTURE_2D, targets.edges.texture());
  pass(outline_, targets);
}

namespace {

ShaderDialect dialect_of_context() {
  current_graphics_device();
  return is_desktop_gl() ? ShaderDialect::desktop : ShaderDialect::embedded;
}

// As a new context is, for who draws in it next.
void leave_context() {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glBindVertexArray(0);
  glUseProgram(0);
  glBindTexture(GL_TEXTURE_2D, 0);
  glDisable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
}

// Throws where a frame agrees too little with the processor's picture of the same.
void check_agreement(const std::vector<JointDrawing::Organ>& organs, const View& view,
                     const DrawOptions& options, const Frame& frame) {
  constexpr double kLeast_db = GraphicsDrawing::kLeastAgreement_db;
  Frame reference;
  JointDrawing().draw(organs, view, options, reference);
  const double psnr_db = compare_images(reference.color, frame.color).psnr_db;
  if (psnr_db < kLeast_db)
    throw GraphicsError("the graphics hardware's picture is not the processor's: they agree to " +
                        to_text(psnr_db, 1) + " dB, less than " + to_text(kLeast_db, 0));
}

// Rows of pictures run from the top, those of the context's own framebuffer from the bottom.
void show(const Targets::Picture& picture, const Intrinsics& size) {
  const GLint width = size.width, height = size.height;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture.framebuffer.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glBlitFramebuffer(0, 0, width, height, 0, height, width, 0, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void throw_errors() {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  if (error == kContextLost) throw GraphicsError("the graphics hardware's context was lost");
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
  const int version = gl_version();
  if (version < (is_desktop_gl() ? 33 : 30))
    throw GraphicsError("drawing with graphics hardware needs OpenGL 3.3 or OpenGL ES 3.0, and '" +
                        name + "' has " + std::to_string(version / 10) + "." +
                        std::to_string(version % 10));
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  return {name, has("llvmpipe") || has("softpipe") || has("SwiftShader") || has("Software") ||
                    has("Basic Render")};
}

struct GraphicsDrawing::Impl {
  ShaderDialect dialect = dialect_of_context();
  OrganPasses passes{dialect};
  std::vector<std::uint8_t> pixels;          // read back
  LastDrawing last{std::uint64_t{1} << 63};  // a module of its own counts the processor's
  bool agreed;                               // with the processor, or that was not asked
  Pictures pictures;

  Impl(FirstPicture first, Pictures to) : agreed(first == FirstPicture::trusted), pictures(to) {}
  DrawReport report() const;
  void read(const Targets::Picture& picture, const DrawOptions& options, Frame& frame,
            DrawReport& report);
};

DrawReport GraphicsDrawing::Impl::report() const {
  DrawReport report;
  report.weights = passes.organs().front().weights;
  for (const PlacedOrgan& organ : passes.organs())
    report.texel_mm = std::max(report.texel_mm, static_cast<float>(organ.texel_mm));
  return report;
}

// Colour and cover, depth where `options` keep it; counts covered pixels.
void GraphicsDrawing::Impl::read(const Targets::Picture& picture, const DrawOptions& options,
                                 Frame& frame, DrawReport& report) {
  const int width = passes.targets().width, height = passes.targets().height;
  const std::size_t count = std::size_t(width) * height;
  frame.resize(width, height, options.keep_depth, false);
  pixels.resize(4 * count);
  glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer.name());
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  for (std::size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) frame.color.pixels[3 * i + c] = pixels[4 * i + c];
    frame.cover[i] = static_cast<Cover>(pixels[4 * i + 3]);
    report.sample_pixels += frame.cover[i] == Cover::samples;
    report.base_pixels += frame.cover[i] == Cover::base;
  }
  if (!options.keep_depth) return;
  glReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, frame.depth_mm.data());
  for (float& depth : frame.depth_mm)
    depth = depth < 1 ? depth * passes.reach_mm() : std::numeric_limits<float>::infinity();
}

GraphicsDrawing::GraphicsDrawing(FirstPicture first, Pictures pictures)
    : impl_(std::make_unique<Impl>(first, pictures)) {
  throw_errors();
}
GraphicsDrawing::~GraphicsDrawing() = default;

std::string GraphicsDrawing::refusal(const std::vector<JointDrawing::Organ>&, const View&,
                                     const DrawOptions& options) const {
  if (options.keep_bound)
    return "it does not tell what skin each pixel shows, which layers of truth ask for";
  if (options.keep_depth && impl_->dialect == ShaderDialect::embedded)
    return "by OpenGL ES it tells no depth";
  return {};
}

bool GraphicsDrawing::shows_pictures() const { return impl_->pictures == Pictures::shown; }

DrawReport GraphicsDrawing::draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                                 const DrawOptions& options, Frame& frame) {
  const bool still = impl_->passes.shows(organs);
  if (still)
    if (const auto report = impl_->last.unchanged(view, options, frame)) return *report;
  Stopwatch watch;
  const Targets::Picture& picture = impl_->passes.draw(organs, view, options);
  DrawReport report = impl_->report();
  const bool shown = shows_pictures();
  if (!shown || !impl_->agreed) impl_->read(picture, options, frame, report);
  if (shown) show(picture, view.camera.intrinsics);
  leave_context();
  throw_errors();
  if (options.measure) report.times.resolve = report.critical_path.resolve = watch.lap();
  if (!impl_->agreed) check_agreement(organs, view, options, frame);
  impl_->agreed = true;
  if (shown) frame = {};
  impl_->last.remember(view, options, report, still, frame);
  return report;
}

std::size_t GraphicsDrawing::table_bytes() const { return impl_->passes.table_bytes(); }

}  // namespace organbake
