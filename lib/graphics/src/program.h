// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gl_names.h"
#include "shader_texts.h"

namespace organbake {

// A compiled program, and its uniforms by name. A name that the program does not use is passed
// over: compilers leave out what does not count.
class Program {
 public:
  // Throws GraphicsError with the compiler's words.
  Program(ShaderDialect dialect, const ProgramFiles& files);

  void use() const;
  // Of the program in use.
  void set(std::string_view name, int value) const;
  void set(std::string_view name, float value) const;
  void set(std::string_view name, const Eigen::Vector2f& value) const;
  void set(std::string_view name, const Eigen::Vector3f& value) const;
  void set(std::string_view name, const Eigen::Vector4f& value) const;
  void set(std::string_view name, const Eigen::Matrix3f& value) const;
  void set(std::string_view name, const Eigen::Vector2i& value) const;
  void set(std::string_view name, const std::array<int, 3>& value) const;
  void set(std::string_view name, const std::array<std::uint32_t, 3>& value) const;
  void set(std::string_view name, std::span<const Eigen::Vector2f> values) const;
  void set(std::string_view name, std::span<const Eigen::Vector3f> values) const;
  void set(std::string_view name, std::span<const Eigen::Vector4f> values) const;
  // Binds a texture to a unit of its own, and the sampler to that.
  void set_texture(std::string_view name, unsigned target, unsigned texture) const;

 private:
  struct Uniform {
    std::string name;
    int location = -1, unit = -1;  // of a sampler
  };
  void read_uniforms();
  const Uniform* find(std::string_view name) const;
  int at(std::string_view name) const;

  ProgramName program_;
  std::vector<Uniform> uniforms_;
};

}  // namespace organbake
