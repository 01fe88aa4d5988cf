// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <algorithm>
#include <array>

#include "opengl.h"
#include "organbake/warp/organ_source.h"

namespace organbake {
namespace {

std::string words_of(unsigned name, void (*length_of)(unsigned, GLint*),
                     void (*read)(unsigned, GLsizei, char*)) {
  GLint length = 0;
  length_of(name, &length);
  std::string words(std::max(1, length), '\0');
  read(name, length, words.data());
  return words.substr(0, words.find('\0'));
}

// A compiled shader, which the program keeps alone once it is linked.
unsigned compile(GLenum kind, const std::string& text, const std::string& name) {
  const unsigned shader = glCreateShader(kind);
  const char* const words = text.c_str();
  glShaderSource(shader, 1, &words, nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  const std::string reason = words_of(
      shader, [](unsigned s, GLint* n) { glGetShaderiv(s, GL_INFO_LOG_LENGTH, n); },
      [](unsigned s, GLsizei n, char* to) { glGetShaderInfoLog(s, n, nullptr, to); });
  glDeleteShader(shader);
  throw GraphicsError("the graphics driver does not compile the shader '" + name + "': " + reason);
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
  if (linked != GL_TRUE) {
    throw GraphicsError(
        "the graphics driver does not link the shaders '" + std::string(files.name) + "': " +
        words_of(
            program, [](unsigned p, GLint* n) { glGetProgramiv(p, GL_INFO_LOG_LENGTH, n); },
            [](unsigned p, GLsizei n, char* to) { glGetProgramInfoLog(p, n, nullptr, to); }));
  }
  read_uniforms();
}

void Program::read_uniforms() {
  GLint count = 0;
  glGetProgramiv(program_.name(), GL_ACTIVE_UNIFORMS, &count);
  use();
  int units = 0;
  for (GLint i = 0; i < count; ++i) {
    std::array<char, 64> name;
    GLint size = 0;
    GLenum type = 0;
    glGetActiveUniform(program_.name(), i, name.size(), nullptr, &size, &type, name.data());
    Uniform uniform{name.data(), glGetUniformLocation(program_.name(), name.data())};
    uniform.name = uniform.name.substr(0, uniform.name.find('['));
    const bool sampler = type == GL_SAMPLER_2D || type == GL_UNSIGNED_INT_SAMPLER_2D ||
                         type == GL_SAMPLER_2D_ARRAY || type == GL_UNSIGNED_INT_SAMPLER_2D_ARRAY ||
                         type == GL_INT_SAMPLER_3D;
    if (sampler) glUniform1i(uniform.location, uniform.unit = units++);
    uniforms_.push_back(std::move(uniform));
  }
}

const Program::Uniform* Program::find(std::string_view name) const {
  const auto found = std::find_if(uniforms_.begin(), uniforms_.end(),
                                  [&](const Uniform& u) { return u.name == name; });
  return found == uniforms_.end() ? nullptr : &*found;
}

int Program::at(std::string_view name) const {
  const Uniform* const uniform = find(name);
  return uniform ? uniform->location : -1;
}

void Program::use() const { glUseProgram(program_.name()); }

void Program::set_texture(std::string_view name, unsigned target, unsigned texture) const {
  const Uniform* const sampler = find(name);
  if (!sampler) return;
  glActiveTexture(GL_TEXTURE0 + sampler->unit);
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
