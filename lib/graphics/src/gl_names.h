// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

namespace organbake {

// The name of an object of OpenGL's, made with this and deleted with it, both while its context is
// the current one.
template <void (*generate)(unsigned*), void (*remove)(unsigned)>
class GlName {
 public:
  GlName() { generate(&name_); }
  ~GlName() {
    if (name_ != 0) remove(name_);
  }
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  unsigned name() const { return name_; }

 private:
  unsigned name_ = 0;
};

void generate_texture(unsigned* name);
void delete_texture(unsigned name);
void generate_framebuffer(unsigned* name);
void delete_framebuffer(unsigned name);
void generate_buffer(unsigned* name);
void delete_buffer(unsigned name);
void generate_vertex_array(unsigned* name);
void delete_vertex_array(unsigned name);
void generate_program(unsigned* name);
void delete_program(unsigned name);

using TextureName = GlName<generate_texture, delete_texture>;
using FramebufferName = GlName<generate_framebuffer, delete_framebuffer>;
using BufferName = GlName<generate_buffer, delete_buffer>;
using VertexArrayName = GlName<generate_vertex_array, delete_vertex_array>;
using ProgramName = GlName<generate_program, delete_program>;

// Of the texture that is bound: single texels are read, never mixed.
void set_nearest(unsigned target);

}  // namespace organbake
