// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// The words that desktop OpenGL 3.3, OpenGL ES 3.0 and WebGL 2 share, but for how a text begins.
enum class ShaderDialect : std::uint8_t { desktop, embedded };  // embedded: WebGL's, too

// The files of lib/graphics/shaders.
struct ShaderFile {
  std::string_view name;
  const char* text;
};
std::span<const ShaderFile> shader_files();

// The files' texts one after the other, behind what the dialect begins with and the constants that
// the processor's way of drawing has, too. `files`: their names, with a blank between two. Throws
// std::out_of_range for a name that is none.
std::string shader_text(ShaderDialect dialect, std::string_view files);

// A program's two texts by their files; captured: outputs of the first one that are written to a
// buffer, with a blank between two.
struct ProgramFiles {
  const char *name, *vertex, *fragment, *captured = "";
};
std::span<const ProgramFiles> program_files();
const ProgramFiles& files_of(std::string_view program);  // by its name

std::vector<std::string> words_in(std::string_view text);

}  // namespace organbake
