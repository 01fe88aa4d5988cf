// SPDX-License-Identifier: Apache-2.0
// OpenGL's objects by their names, tables as textures, targets, and programs made of the shaders'
// texts.
#include "gl.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "organbake/warp/organ_source.h"

namespace organbake {
void set_nearest(unsigned target) {
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(target, filter, GL_NEAREST);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(target, axis, GL_CLAMP_TO_EDGE);
}

void Table::reserve(std::size_t texels) {
  const std::size_t rows = std::max<std::size_t>(1, (texels + kColumns - 1) / kColumns);
  if (rows <= rows_) return;
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (rows > static_cast<std::size_t>(most))
    throw GraphicsError("an organ of so many samples does not fit into this graphics hardware (" +
                        std::to_string(rows) + " rows of " + std::to_string(most) + ")");
  rows_ = rows;
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, texel_.internal, kColumns, static_cast<GLsizei>(rows), 0,
               texel_.format, texel_.type, nullptr);
  set_nearest(GL_TEXTURE_2D);
}

// Whole rows at once, or a part of one.
void Table::upload(std::size_t first, const void* numbers, std::size_t texels) {
  constexpr std::size_t kTexel_bytes = 16;
  const auto* from = static_cast<const std::byte*>(numbers);
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  while (texels > 0) {
    const std::size_t column = first % kColumns, rows = column == 0 ? texels / kColumns : 0;
    const std::size_t width = rows > 0 ? kColumns : std::min(texels, kColumns - column);
    const std::size_t height = std::max<std::size_t>(1, rows);
    glTexSubImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(column),
                    static_cast<GLint>(first / kColumns), static_cast<GLsizei>(width),
                    static_cast<GLsizei>(height), texel_.format, texel_.type, from);
    first += width * height, texels -= width * height, from += kTexel_bytes * width * height;
  }
}

namespace {

void bind_targets(const FramebufferName& framebuffer, const Target& color, const Target* depth,
                  int layer = 0) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  color.attach(layer);
  if (depth) depth->attach(layer);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw GraphicsError("the graphics driver refuses a picture of this size and kind");
}

constexpr const char* kDesktop = "#version 330 core\n";
constexpr const char* kEmbedded =
    "#version 300 es\n"
    "precision highp float;\n"
    "precision highp int;\n";

std::string glsl(int value) { return std::to_string(value); }
std::string glsl(double value) {
  std::array<char, 40> text;
  std::snprintf(text.data(), text.size(), "%.9e", value);
  return text.data();
}
std::string glsl(const std::array<float, 3>& v) {
  return "vec3(" + glsl(double{v[0]}) + "," + glsl(double{v[1]}) + "," + glsl(double{v[2]}) + ")";
}

std::string constants() {
  std::vector<ShaderConstant> all = shader_constants();
  all.insert(all.end(), {{"kSlots", int(kChunk)},
                         {"kTableBits", Table::kBits},
                         {"kTableColumns", Table::kColumns},
                         {"kColorRoot", kColorRoot},
                         {"kCoverSamples", double(Cover::samples)},
                         {"kCoverBase", double(Cover::base)},
                         {"kCoverFilled", double(Cover::filled)},
                         {"kCoverSolid", double(Cover::solid)}});
  std::string text;
  for (const auto& [name, number] : all)
    text += "#define " + std::string(name) + " " +
            std::visit([](const auto& value) { return glsl(value); }, number) + "\n";
  return text;
}

#ifdef __EMSCRIPTEN__
// A page holds the texts, and puts them in the names' places.
std::string text_of(const std::string& name) { return "@" + name + "\n"; }
#else
std::string text_of(const std::string& name) {
  for (const ShaderFile& file : shader_files())
    if (file.name == name) return file.text;
  throw std::out_of_range("there is no shader " + name);
}
#endif

std::vector<std::string> words_in(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::string>(words), {}};
}

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

unsigned Target::target() const { return layers_ > 0 ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D; }

void Target::resize(int width, int height) {
  const auto [internal, format, type] = texel_;
  glBindTexture(target(), texture_.name());
  if (layers_ > 0) {
    glTexImage3D(target(), 0, internal, width, height, layers_, 0, format, type, nullptr);
  } else {
    glTexImage2D(target(), 0, internal, width, height, 0, format, type, nullptr);
  }
  set_nearest(target());
}

void Target::attach(int layer) const {
  const bool is_depth = texel_.format == GL_DEPTH_COMPONENT;
  const GLenum as = is_depth ? GL_DEPTH_ATTACHMENT : GL_COLOR_ATTACHMENT0;
  if (layers_ > 0) {
    glFramebufferTextureLayer(GL_FRAMEBUFFER, as, texture_.name(), 0, layer);
  } else {
    glFramebufferTexture2D(GL_FRAMEBUFFER, as, GL_TEXTURE_2D, texture_.name(), 0);
  }
}

void Targets::resize(int new_width, int new_height) {
  if (new_width == width && new_height == height) return;
  width = new_width, height = new_height;
  for (Target* target : {&keys, &depths, &edges}) target->resize(width, height);
  for (Picture* picture : {&base, &resolved, &finished[0], &finished[1]}) {
    picture->color.resize(width, height);
    picture->depth.resize(width, height);
    bind_targets(picture->framebuffer, picture->color, &picture->depth);
  }
  for (int l = 0; l < kLayers; ++l) bind_targets(layers[l], keys, &depths, l);
  bind_targets(edge_picture, edges, nullptr);
}

std::string shader_text(ShaderDialect dialect, const std::string& files) {
  static const std::string of_all = constants();
  std::string text = (dialect == ShaderDialect::desktop ? kDesktop : kEmbedded) + of_all;
  for (const std::string& name : words_in(files)) text += text_of(name);
  return text;
}

std::span<const ProgramFiles> program_files() {
  static constexpr std::array<ProgramFiles, 13> kFiles = {{
      {"place", "tables.glsl shell.glsl place.vert", "place.frag",
       "plane outward bend texel_per_pixel splat"},
      {"splat", "tables.glsl splat.vert", "splat.frag"},
      {"base", "tables.glsl shell.glsl base.vert", "base.frag"},
      {"resolve", "screen.vert", "tables.glsl skin.glsl light.glsl resolve.frag"},
      {"open", "screen.vert", "finish.glsl pass.glsl open.frag"},
      {"slits", "screen.vert", "finish.glsl pass.glsl slits.frag"},
      {"across", "screen.vert", "finish.glsl across.frag"},
      {"fade", "screen.vert", "finish.glsl pass.glsl fade.frag"},
      {"shadows", "screen.vert", "tables.glsl tools.glsl finish.glsl pass.glsl shadows.frag"},
      {"wounds", "screen.vert", "tables.glsl tools.glsl finish.glsl pass.glsl wounds.frag"},
      {"solids", "screen.vert", "tables.glsl tools.glsl finish.glsl pass.glsl solids.frag"},
      {"edges", "screen.vert", "finish.glsl edges.frag"},
      {"outline", "screen.vert", "finish.glsl pass.glsl outline.frag"},
  }};
  return kFiles;
}

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

void Program::set_texture(std::string_view name, unsigned target, unsigned texture) const {
  Uniform& sampler = find(name);
  if (sampler.location < 0) return;
  if (sampler.unit < 0) glUniform1i(sampler.location, sampler.unit = units_++);
  glActiveTexture(GL_TEXTURE0 + sampler.unit);
  glBindTexture(target, texture);
  glActiveTexture(GL_TEXTURE0);
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

}  // namespace organbake
