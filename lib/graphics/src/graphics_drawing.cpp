// SPDX-License-Identifier: Apache-2.0
// Draws organs by OpenGL, and finishes the picture as lib/warp's finishing does.
#include "organbake/graphics/graphics_drawing.h"

#include <limits>

#include "organ_passes.h"
#include "organbake/core/stopwatch.h"
#include "organbake/core/text.h"
#include "organbake/image/difference.h"

namespace organbake {
namespace {

// The passes over a whole picture, each of which makes the next one from the last one.
struct Finishing {
  const View& view;
  const DrawOptions& options;
  const PictureScale& scale;
  const Programs& programs;
  Table& tools;
  const Targets& targets;
  const Targets::Picture* last = &targets.resolved;
  int next = 0;  // of targets.finished
  const RigidTransform& pose = view.camera.camera_from_world;

  const Targets::Picture& apply() {
    glDepthFunc(GL_ALWAYS);
    fill_slits();
    if (options.smooth_outline && scale.fade_px > 1) fade_borders();
    draw_blood();
    if (!options.solids.empty()) draw_solids();
    draw_smoke();
    if (options.smooth_outline) smooth_outlines();
    return *last;
  }

 private:
  // With a program that is in use and set.
  void draw_into(const FramebufferName& framebuffer, const Program& program) const {
    program.set("picture", Eigen::Vector2f(float(targets.width), float(targets.height)));
    program.set_texture("colors", GL_TEXTURE_2D, last->color.texture());
    program.set_texture("depths", GL_TEXTURE_2D, last->depth.texture());
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  void pass(const Program& program) {
    const Targets::Picture& to = targets.finished[next];
    draw_into(to.framebuffer, program);
    next = 1 - next;
    last = &to;
  }

  void fill_slits() {
    const Program& open = programs.use("open");
    open.set("texel", scale.texel_mm / scale.reach_mm);
    pass(open);
    const Program& slits = programs.use("slits");
    for (const Eigen::Vector2i& back : {Eigen::Vector2i(0, -1), Eigen::Vector2i(-1, 0)}) {
      slits.set("back", back);
      pass(slits);
    }
  }

  void fade_borders() {
    const Program& across = programs.use("across");
    across.set("fade", scale.fade_px);
    draw_into(targets.edge_picture, across);
    const Program& fade = programs.use("fade");
    fade.set_texture("across", GL_TEXTURE_2D, targets.edges.texture());
    fade.set("fade", scale.fade_px);
    const auto& [red, green, blue] = options.background;
    fade.set("background", Eigen::Vector3f(Eigen::Vector3f(red, green, blue) / 255));
    pass(fade);
  }

  // What a shader knows of a solid, a bead of blood or a puff of smoke: four texels each.
  using Texels = std::vector<Eigen::Vector4f>;
  static Eigen::Vector4f texel(const Eigen::Vector3d& at, double more = 0) {
    return Eigen::Vector4d(at.x(), at.y(), at.z(), more).cast<float>();
  }

  // In a box of the picture, with a program that draws what a table holds.
  void pass_tools(const char* name, const Texels& of_all, const PixelBox& box, bool smoke = false) {
    if (box.empty()) return;
    tools.fill(of_all);
    const Program& program = programs.use(name);
    program.set_texture("tools", GL_TEXTURE_2D, tools.texture());
    program.set("tool_count", static_cast<int>(of_all.size() / 4));
    program.set("tool_box",
                Eigen::Vector4f(float(box.x0), float(box.y0), float(box.x1), float(box.y1)));
    program.set("lens", lens_of(view.camera.intrinsics));
    program.set("near_mm", static_cast<float>(view.near_mm));
    program.set("reach", scale.reach_mm);
    program.set("at_scope", int(scale.scope_light_mm.has_value()));
    program.set("light_mm", scale.scope_light_mm.value_or(Eigen::Vector3f::Zero()));
    program.set("smoke", int(smoke));
    pass(program);
  }

  void draw_solids() {
    Texels of_all;
    for (const Solid& solid : options.solids) {
      const Eigen::Vector3d third =
          solid.corner ? pose * *solid.corner : Eigen::Vector3d(pose.rotation * solid.pressed_mm);
      of_all.insert(of_all.end(), {texel(pose * solid.from, solid.radius_mm),
                                   texel(pose * solid.to, solid.corner ? 1 : 0), texel(third),
                                   texel(solid.color.cast<double>())});
    }
    if (scale.relit) pass_tools("shadows", of_all, box_round(with_shadows(options.solids), view));
    pass_tools("solids", of_all, box_round(options.solids, view));
  }

  void draw_blood() {
    Texels of_all;
    PixelBox box;
    for (const BloodLine& line : options.blood) {
      of_all.insert(of_all.end(),
                    {texel(pose * line.from_mm, line.from_radius_mm),
                     texel(pose * line.to_mm, line.to_radius_mm),
                     texel(pose.rotation * line.outward), texel(pose.rotation * line.down_wall)});
      box = united(box, box_round(line, view));
    }
    pass_tools("wounds", of_all, box);
  }

  void draw_smoke() {
    Texels of_all;
    PixelBox box;
    const Eigen::Vector3d unused = Eigen::Vector3d::Zero();
    for (const SmokePuff& puff : options.smoke) {
      of_all.insert(of_all.end(), {texel(pose * puff.middle_mm, puff.radius_mm),
                                   texel(unused, puff.share), texel(unused), texel(unused)});
      box = united(box, box_round(puff, view));
    }
    pass_tools("wounds", of_all, box, true);
  }

  void smooth_outlines() {
    const Program& edges = programs.use("edges");
    edges.set("texel", scale.texel_mm / scale.reach_mm);
    edges.set_texture("skin_depths", GL_TEXTURE_2D, targets.resolved.depth.texture());
    draw_into(targets.edge_picture, edges);
    const Program& outline = programs.use("outline");
    outline.set_texture("edges", GL_TEXTURE_2D, targets.edges.texture());
    pass(outline);
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
  const GraphicsDevice device = current_graphics_device();  // throws before shaders are compiled
  ShaderDialect dialect = is_desktop_gl() ? ShaderDialect::desktop : ShaderDialect::embedded;
  Programs programs{dialect};
  OrganPasses passes{programs};
  Table tools{kFloats};
  std::vector<std::uint8_t> pixels;          // read back
  LastDrawing last{std::uint64_t{1} << 63};  // a module of its own counts the processor's
  bool agreed;                               // with the processor, or that was not asked
  Pictures pictures;

  Impl(FirstPicture first, Pictures to) : agreed(first == FirstPicture::trusted), pictures(to) {}

  // Colour and cover, depth where `options` keep it; counts covered pixels.
  void read(const Targets::Picture& picture, const Intrinsics& size, const DrawOptions& options,
            Frame& frame, DrawReport& report) {
    const int width = size.width, height = size.height;
    frame.resize(width, height, options.keep_depth, false);
    pixels.resize(4 * frame.cover.size());
    glBindFramebuffer(GL_FRAMEBUFFER, picture.framebuffer.name());
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    for (std::size_t i = 0; i < frame.cover.size(); ++i) {
      for (int c = 0; c < 3; ++c) frame.color.pixels[3 * i + c] = pixels[4 * i + c];
      frame.cover[i] = static_cast<Cover>(pixels[4 * i + 3]);
      report.sample_pixels += frame.cover[i] == Cover::samples;
      report.base_pixels += frame.cover[i] == Cover::base;
    }
    if (!options.keep_depth) return;
    glReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, frame.depth_mm.data());
    for (float& depth : frame.depth_mm)
      depth = depth < 1 ? depth * passes.scale().reach_mm : std::numeric_limits<float>::infinity();
  }
};

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
  const Targets& targets = impl_->passes.draw(organs, view, options);
  const PictureScale& scale = impl_->passes.scale();
  const Targets::Picture& picture =
      Finishing{view, options, scale, impl_->programs, impl_->tools, targets}.apply();
  DrawReport report;
  report.weights = impl_->passes.first_weights();
  report.texel_mm = scale.texel_mm;
  const bool shown = shows_pictures();
  const Intrinsics& size = view.camera.intrinsics;
  if (!shown || !impl_->agreed) impl_->read(picture, size, options, frame, report);
  if (shown) show(picture, size);
  leave_context();
  throw_errors();
  if (options.measure) report.times.resolve = report.critical_path.resolve = watch.lap();
  if (!impl_->agreed) check_agreement(organs, view, options, frame);
  impl_->agreed = true;
  if (shown) frame = {};
  impl_->last.remember(view, options, report, still, frame);
  return report;
}

}  // namespace organbake
