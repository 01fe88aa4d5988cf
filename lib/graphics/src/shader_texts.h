// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace organbake {

// The words that desktop OpenGL 3.3, OpenGL ES 3.0 and WebGL 2 share, but for how a text begins.
enum class ShaderDialect : std::uint8_t { desktop, embedded };  // embedded: WebGL's, too

// The files of lib/graphics/shaders by name.
const std::map<std::string, std::string>& shader_files();

// The files' texts one after the other, behind what the dialect begins with and the constants that
// the processor's way of drawing has, too. Throws std::out_of_range for a name that is none.
std::string shader_text(ShaderDialect dialect, const std::vector<std::string>& files);

// A program's two texts by their files; captured: outputs of the first one that are written to a
// buffer.
struct ProgramFiles {
  std::string name;
  std::vector<std::string> vertex, fragment;
  std::vector<const char*> captured = {};
};
const std::vector<ProgramFiles>& program_files();
const ProgramFiles& files_of(const std::string& program);  // by its name

}  // namespace organbake
