// SPDX-License-Identifier: Apache-2.0
#include "gl_names.h"

#include "opengl.h"

namespace organbake {

void generate_texture(unsigned* name) { glGenTextures(1, name); }
void delete_texture(unsigned name) { glDeleteTextures(1, &name); }
void generate_framebuffer(unsigned* name) { glGenFramebuffers(1, name); }
void delete_framebuffer(unsigned name) { glDeleteFramebuffers(1, &name); }
void generate_buffer(unsigned* name) { glGenBuffers(1, name); }
void delete_buffer(unsigned name) { glDeleteBuffers(1, &name); }
void generate_vertex_array(unsigned* name) { glGenVertexArrays(1, name); }
void delete_vertex_array(unsigned name) { glDeleteVertexArrays(1, &name); }
void generate_program(unsigned* name) { *name = glCreateProgram(); }
void delete_program(unsigned name) { glDeleteProgram(name); }

void set_nearest(unsigned target) {
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(target, filter, GL_NEAREST);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(target, axis, GL_CLAMP_TO_EDGE);
}

}  // namespace organbake
