// SPDX-License-Identifier: Apache-2.0
#include "table.h"

#include <string>

#include "opengl.h"
#include "organbake/warp/organ_source.h"

namespace organbake {
namespace {

constexpr std::size_t kRowNumbers = std::size_t{4} * Table::kColumns;

}  // namespace

std::size_t Table::whole_rows(std::size_t numbers) {
  return std::max<std::size_t>(1, (numbers + kRowNumbers - 1) / kRowNumbers) * kRowNumbers;
}

void Table::upload(const void* numbers, std::size_t count) {
  const int rows = static_cast<int>(count / kRowNumbers);
  const bool words = texel_ == Texel::words;
  const GLenum format = words ? GL_RGBA_INTEGER : GL_RGBA,
               type = words ? GL_UNSIGNED_INT : GL_FLOAT;
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  if (rows == rows_) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kColumns, rows, format, type, numbers);
    return;
  }
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (rows > most)
    throw GraphicsError("an organ of so many samples does not fit into this graphics hardware (" +
                        std::to_string(rows) + " rows of " + std::to_string(most) + ")");
  glTexImage2D(GL_TEXTURE_2D, 0, words ? GL_RGBA32UI : GL_RGBA32F, kColumns, rows, 0, format, type,
               numbers);
  set_nearest(GL_TEXTURE_2D);
  rows_ = rows;
}

}  // namespace organbake
