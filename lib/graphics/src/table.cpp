// SPDX-License-Identifier: Apache-2.0
#include "table.h"

#include <algorithm>
#include <string>

#include "opengl.h"
#include "organbake/warp/organ_source.h"

namespace organbake {

void Table::reserve(std::size_t texels) {
  const std::size_t rows = std::max<std::size_t>(1, (texels + kColumns - 1) / kColumns);
  if (rows <= rows_) return;
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (rows > static_cast<std::size_t>(most))
    throw GraphicsError("an organ of so many samples does not fit into this graphics hardware (" +
                        std::to_string(rows) + " rows of " + std::to_string(most) + ")");
  rows_ = rows;
  const bool words = texel_ == Texel::words;
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, words ? GL_RGBA32UI : GL_RGBA32F, kColumns,
               static_cast<GLsizei>(rows), 0, words ? GL_RGBA_INTEGER : GL_RGBA,
               words ? GL_UNSIGNED_INT : GL_FLOAT, nullptr);
  set_nearest(GL_TEXTURE_2D);
}

// Whole rows at once, or a part of one.
void Table::upload(std::size_t first, const void* numbers, std::size_t texels) {
  constexpr std::size_t kTexel_bytes = 16;
  const bool words = texel_ == Texel::words;
  const auto* from = static_cast<const std::byte*>(numbers);
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  while (texels > 0) {
    const std::size_t column = first % kColumns, rows = column == 0 ? texels / kColumns : 0;
    const std::size_t width = rows > 0 ? kColumns : std::min(texels, kColumns - column);
    const std::size_t height = std::max<std::size_t>(1, rows);
    glTexSubImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(column),
                    static_cast<GLint>(first / kColumns), static_cast<GLsizei>(width),
                    static_cast<GLsizei>(height), words ? GL_RGBA_INTEGER : GL_RGBA,
                    words ? GL_UNSIGNED_INT : GL_FLOAT, from);
    first += width * height, texels -= width * height, from += kTexel_bytes * width * height;
  }
}

}  // namespace organbake
