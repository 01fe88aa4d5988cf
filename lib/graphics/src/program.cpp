// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <array>
#include <utility>

#include "opengl.h"
#include "organbake/warp/organ_source.h"

namespace organbake {
namespace {

using Log = std::array<char, 4096>;  // what a driver says, as far as anybody reads

// A compiled shader, which the program keeps alone once it is linked.
unsigned compile(GLenum kind, const std::string& text, const std::string& name) {
  const unsigned shader = glCreateShader(kind);
  const char* const words = text.c_str();
  glShaderSource(shader, 1, &words, nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  Log log{};
  glGetShaderInfoLog(shader, log.size(), nullptr, log.data());
  glDeleteShader(shader);
  throw GraphicsError("the graphics driver does not compile the shader '" + name +
                      "': " + log.data());
}

}  // namespace

Program::Program(ShaderDialect dialect, const ProgramFiles& files) {
  const unsigned program = program_.name();
  for (const auto& [kind, parts] :
       {std::pair{GL_VERTEX_SHADER, files.vertex}, std::pair{GL_FRAGMENT_SHADER, files.fragment}}) {
    const unsigned shader = compile(kind, shader_text(dialect, parts), files.name);
    glAttachShader(program, shader);
    glDeleteShader(shader);
  }
  const std::vector<std::string> captured = words_in(files.captured);
  std::vector<const char*> outputs;
  for (const std::string& output : captured) outputs.push_back(output.c_str());
  if (!outputs.empty())
    glTransformFeedbackVaryings(program, static_cast<GLsizei>(outputs.size()), outputs.data(),
                                GL_INTERLEAVED_ATTRIBS);
  glLinkProgram(program);
  GLint linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return;
  Log log{};
  glGetProgramInfoLog(program, log.size(), nullptr, log.data());
  throw GraphicsError("the graphics driver does not link the shaders '" + std::string(files.name) +
                      "': " + log.data());
}

Program::Uniform& Program::find(std::string_view name) const {
  const auto found = uniforms_.find(name);
  if (found != uniforms_.end()) return found->second;
  const std::string text(name);
  return uniforms_[text] = {glGetUniformLocation(program_.name(), text.c_str())};
}

int Program::at(std::string_view name) const { return find(name).location; }

void Program::use() const { glUseProgram(program_.name()); }

void Program::set_texture(std::string_view name, unsigned target, unsigned texture) const {
  Uniform& sampler = find(name);
  if (sampler.location < 0) return;
  if (sampler.unit < 0) glUniform1i(sampler.location, sampler.unit = units_++);
  glActiveTexture(GL_TEXTURE0 + sampler.unit);
  glBindTexture(target, texture);
  glActiveTexture(GL_TEXTURE0);
}

void Program::set(std::string_view name, int value) const { glUniform1i(at(name), value); }
void Program::set(std::string_view name, float value) const { glUniform1f(at(name), value); }
void Program::set(std::string_view name, const Eigen::Matrix3f& value) const {
  glUniformMatrix3fv(at(name), 1, GL_FALSE, value.data());
}

// Of the sizes that shaders have.
void Program::upload(std::string_view name, const float* numbers, int size, int count) const {
  if (size == 2) glUniform2fv(at(name), count, numbers);
  if (size == 3) glUniform3fv(at(name), count, numbers);
  if (size == 4) glUniform4fv(at(name), count, numbers);
}
void Program::upload(std::string_view name, const int* numbers, int size, int count) const {
  if (size == 2) glUniform2iv(at(name), count, numbers);
  if (size == 3) glUniform3iv(at(name), count, numbers);
}
void Program::upload(std::string_view name, const unsigned* numbers, int, int count) const {
  glUniform3uiv(at(name), count, numbers);
}

}  // namespace organbake
