// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gl_names.h"
#include "organbake/geometry/camera.h"
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
  void set(std::string_view name, const Eigen::Matrix3f& value) const;
  template <class Number, int size>
  void set(std::string_view name, const Eigen::Matrix<Number, size, 1>& value) const {
    upload(name, value.data(), size, 1);
  }
  template <class Number, int size>
  void set(std::string_view name, std::span<const Eigen::Matrix<Number, size, 1>> values) const {
    if (!values.empty()) upload(name, values.front().data(), size, static_cast<int>(values.size()));
  }
  // Binds a texture to a unit of its own, and the sampler to that. Before the program first draws
  // all its samplers must be set: those that are not share a unit.
  void set_texture(std::string_view name, unsigned target, unsigned texture) const;

 private:
  struct Uniform {
    int location = -1, unit = -1;  // of a sampler
  };
  Uniform& find(std::string_view name) const;
  int at(std::string_view name) const;
  void upload(std::string_view name, const float* numbers, int size, int count) const;
  void upload(std::string_view name, const int* numbers, int size, int count) const;
  void upload(std::string_view name, const unsigned* numbers, int size, int count) const;

  ProgramName program_;
  // Those that were asked for.
  mutable std::map<std::string, Uniform, std::less<>> uniforms_;
  mutable int units_ = 0;
};

inline Eigen::Vector4f lens_of(const Intrinsics& k) {
  return Eigen::Vector4d(k.fx, k.fy, k.cx, k.cy).cast<float>();
}

}  // namespace organbake
