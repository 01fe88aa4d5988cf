// SPDX-License-Identifier: Apache-2.0
#include "organbake/graphics/graphics_drawing.h"

#include <cstdint>

#include "first_picture.h"
#include "opengl.h"
#include "organ_passes.h"
#include "organbake/core/stopwatch.h"
#include "organbake/warp/last_drawing.h"
#include "read_back.h"

namespace organbake {
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
  ReadBack read_back;
  LastDrawing last{std::uint64_t{1} << 63};  // a module of its own counts the processor's
  bool agreed;                               // with the processor, or that was not asked
  Pictures pictures;

  Impl(FirstPicture first, Pictures to) : agreed(first == FirstPicture::trusted), pictures(to) {}
  DrawReport report() const;
};

DrawReport GraphicsDrawing::Impl::report() const {
  DrawReport report;
  report.weights = passes.organs().front().weights;
  for (const PlacedOrgan& organ : passes.organs())
    report.texel_mm = std::max(report.texel_mm, static_cast<float>(organ.texel_mm));
  return report;
}

GraphicsDrawing::GraphicsDrawing(FirstPicture first, Pictures pictures)
    : impl_(std::make_unique<Impl>(first, pictures)) {
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
  if (!shown || !impl_->agreed)
    impl_->read_back.read(impl_->passes, picture, options, frame, report);
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
