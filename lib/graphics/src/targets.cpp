// SPDX-License-Identifier: Apache-2.0
#include "targets.h"

#include "opengl.h"
#include "organbake/warp/organ_source.h"
#include "table.h"

namespace organbake {
namespace {

struct Format {
  GLint internal;
  GLenum format, type;
};

constexpr std::array<Format, 4> kFormats = {{{GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE},
                                             {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT},
                                             {GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT},
                                             {GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE}}};

void bind_targets(const FramebufferName& framebuffer, const Target& color, const Target* depth,
                  int layer = 0) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  color.attach(layer);
  if (depth) depth->attach(layer);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw GraphicsError("the graphics driver refuses a picture of this size and kind");
}

}  // namespace

unsigned Target::target() const { return layers_ > 0 ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D; }

void Target::resize(int width, int height) {
  const auto [internal, format, type] = kFormats[static_cast<std::size_t>(kind_)];
  glBindTexture(target(), texture_.name());
  if (layers_ > 0) {
    glTexImage3D(target(), 0, internal, width, height, layers_, 0, format, type, nullptr);
  } else {
    glTexImage2D(target(), 0, internal, width, height, 0, format, type, nullptr);
  }
  set_nearest(target());
}

void Target::attach(int layer) const {
  const GLenum as = kind_ == Kind::depth ? GL_DEPTH_ATTACHMENT : GL_COLOR_ATTACHMENT0;
  if (layers_ > 0) {
    glFramebufferTextureLayer(GL_FRAMEBUFFER, as, texture_.name(), 0, layer);
  } else {
    glFramebufferTexture2D(GL_FRAMEBUFFER, as, GL_TEXTURE_2D, texture_.name(), 0);
  }
}

void Targets::resize(int new_width, int new_height) {
  if (new_width == width && new_height == height) return;
  width = new_width, height = new_height;
  for (Target* target : {&keys, &depths, &base_bound, &base_depth, &edges})
    target->resize(width, height);
  for (Picture* picture : {&resolved, &finished[0], &finished[1]}) {
    picture->color.resize(width, height);
    picture->depth.resize(width, height);
    bind_targets(picture->framebuffer, picture->color, &picture->depth);
  }
  for (int l = 0; l < kLayers; ++l) bind_targets(layers[l], keys, &depths, l);
  bind_targets(base, base_bound, &base_depth);
  bind_targets(edge_picture, edges, nullptr);
}

void Stretches::resize(int faces) {
  const int rows = (faces + Table::kColumns - 1) / Table::kColumns;
  if (rows == rows_) return;
  rows_ = rows;
  color_.resize(Table::kColumns, rows_);
  bind_targets(framebuffer_, color_, nullptr);
}

void Stretches::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, Table::kColumns, rows_);
  constexpr std::array<float, 4> kNone = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, kNone.data());
}

}  // namespace organbake
