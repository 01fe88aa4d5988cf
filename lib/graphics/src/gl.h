// SPDX-License-Identifier: Apache-2.0
#pragma once

// The words that OpenGL 3.3, OpenGL ES 3.0 and WebGL 2 share, by libepoxy; for pages by
// emscripten's headers of OpenGL ES 3.0, whose functions the page gives the module
// (apps/organweb/page/webgl.js).
#ifdef __EMSCRIPTEN__
#include <GLES3/gl3.h>
#else
#include <epoxy/gl.h>
#endif

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/geometry/camera.h"

namespace organbake {

#ifdef __EMSCRIPTEN__
inline bool is_desktop_gl() { return false; }
inline int gl_version() { return 30; }  // a page makes no context of another
#else
inline bool is_desktop_gl() { return epoxy_is_desktop_gl(); }
inline int gl_version() { return epoxy_gl_version(); }
#endif
// Names of one of the three alone.
inline constexpr unsigned kProgramPointSize = 0x8642, kContextLost = 0x0507;

// The name of an object of OpenGL's, made with this and deleted with it, both while its context is
// the current one.
template <auto& generate, auto& remove>
class GlName {
 public:
  GlName() { generate(1, &name_); }
  ~GlName() { remove(1, &name_); }
  GlName(const GlName&) = delete;
  unsigned name() const { return name_; }

 private:
  unsigned name_ = 0;
};

using TextureName = GlName<glGenTextures, glDeleteTextures>;
using FramebufferName = GlName<glGenFramebuffers, glDeleteFramebuffers>;
using BufferName = GlName<glGenBuffers, glDeleteBuffers>;
using VertexArrayName = GlName<glGenVertexArrays, glDeleteVertexArrays>;
// The only ones that are made one by one.
inline void generate_program(int, unsigned* name) { *name = glCreateProgram(); }
inline void delete_program(int, const unsigned* name) { glDeleteProgram(*name); }
using ProgramName = GlName<generate_program, delete_program>;

// Of the texture that is bound: single texels are read, never mixed.
void set_nearest(unsigned target);

// What a texel of a texture holds, as OpenGL names that.
struct TexelFormat {
  int internal;
  unsigned format, type;
};
// Of tables four of 32 bits each; of targets four bytes, a float, two words, a byte.
inline constexpr TexelFormat kFloats = {GL_RGBA32F, GL_RGBA, GL_FLOAT},
                             kWords = {GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT},
                             kColor = {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE},
                             kDepth = {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT},
                             kKey = {GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT},
                             kEdges = {GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE};

inline constexpr double kColorRoot = 2;  // the largest root of a colour that a table holds

// A table that shaders read by texelFetch(…, table_at(i), 0): a texture of kColumns texels a row.
// Its memory stays from one filling to the next.
class Table {
 public:
  static constexpr int kBits = 11, kColumns = 1 << kBits;

  explicit Table(const TexelFormat& texel) : texel_(texel) {}
  // Room for so many texels. Where there was less, what was in it is lost.
  void reserve(std::size_t texels);
  // Floats or words, or whole texels of them, into the room from a texel on.
  template <class Number>
  void put(std::size_t first, const std::vector<Number>& numbers) {
    static_assert(sizeof(Number) == 4 || sizeof(Number) % 16 == 0);
    upload(first, numbers.data(), numbers.size() * sizeof(Number) / 16);
  }
  template <class Number>
  void fill(const std::vector<Number>& numbers) {
    reserve(numbers.size() * sizeof(Number) / 16);
    put(0, numbers);
  }
  unsigned texture() const { return texture_.name(); }
  std::size_t bytes() const { return std::size_t{16} * kColumns * rows_; }

 private:
  void upload(std::size_t first, const void* numbers, std::size_t texels);

  TexelFormat texel_;
  TextureName texture_;
  std::size_t rows_ = 0;
};

// A texture of a picture's size, or one of its layers, to draw into and to read.
class Target {
 public:
  Target(const TexelFormat& texel, int layers = 0)  // 0: no array
      : texel_(texel), layers_(layers) {}
  void resize(int width, int height);
  unsigned texture() const { return texture_.name(); }
  unsigned target() const;
  // To the framebuffer that is bound.
  void attach(int layer = 0) const;

 private:
  TexelFormat texel_;
  int layers_;
  TextureName texture_;
};

// All that a picture of one size is drawn into.
struct Targets {
  static constexpr int kLayers = 3;  // cameras of a view
  // A picture and the depth of its skin.
  struct Picture {
    Target color{kColor}, depth{kDepth};
    FramebufferName framebuffer{};
  };

  int width = 0, height = 0;
  Target keys{kKey, kLayers}, depths{kDepth, kLayers};
  std::array<FramebufferName, kLayers> layers;
  Picture base{kKey}, resolved;     // the base tells where its skin is bound
  std::array<Picture, 2> finished;  // turn about
  Target edges{kEdges};
  FramebufferName edge_picture;

  void resize(int new_width, int new_height);
};

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
std::string shader_text(ShaderDialect dialect, const std::string& files);

// A program's two texts by their files; captured: outputs of the first one that are written to a
// buffer, with a blank between two.
struct ProgramFiles {
  const char *name, *vertex, *fragment, *captured = "";
};
std::span<const ProgramFiles> program_files();

// A compiled program, and its uniforms by name. A name that the program does not use is passed
// over: compilers leave out what does not count.
class Program {
 public:
  // Throws GraphicsError with the compiler's words.
  Program(ShaderDialect dialect, const ProgramFiles& files);

  void use() const { glUseProgram(program_.name()); }
  // Of the program in use.
  void set(std::string_view name, int value) const { glUniform1i(at(name), value); }
  void set(std::string_view name, float value) const { glUniform1f(at(name), value); }
  void set(std::string_view name, const Eigen::Matrix3f& value) const {
    glUniformMatrix3fv(at(name), 1, GL_FALSE, value.data());
  }
  template <class Number, int size>
  void set(std::string_view name, const Eigen::Matrix<Number, size, 1>& value) const {
    upload(name, value.data(), size, 1);
  }
  template <class Number, int size>
  void set(std::string_view name, const std::vector<Eigen::Matrix<Number, size, 1>>& values) const {
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
  int at(std::string_view name) const { return find(name).location; }
  void upload(std::string_view name, const float* numbers, int size, int count) const;
  void upload(std::string_view name, const int* numbers, int size, int count) const;

  ProgramName program_;
  // Those that were asked for.
  mutable std::map<std::string, Uniform, std::less<>> uniforms_;
  mutable int units_ = 0;
};

// All programs, by their names.
class Programs {
 public:
  explicit Programs(ShaderDialect dialect) {
    for (const ProgramFiles& files : program_files())
      programs_.try_emplace(files.name, dialect, files);
  }
  // That draws from now on.
  const Program& use(std::string_view name) const {
    const Program& program = programs_.at(name);
    program.use();
    return program;
  }

 private:
  std::map<std::string_view, Program> programs_;
};

inline Eigen::Vector4f lens_of(const Intrinsics& k) {
  return Eigen::Vector4d(k.fx, k.fy, k.cx, k.cy).cast<float>();
}

}  // namespace organbake
