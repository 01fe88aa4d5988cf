// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh as game engines draw it, by Mesa's llvmpipe: EGL without a display, one texture, the
// vertices of each frame uploaded anew.
#include "peers/peers.h"

#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>
#include <cstdlib>

#include "organbake/core/error.h"

namespace organbake {
namespace {

constexpr const char* kVertexShader = R"(#version 140
in vec3 position; in vec2 texel; out vec2 at; uniform mat4 clip_from_world;
void main() { at = texel; gl_Position = clip_from_world * vec4(position, 1.0); })";
constexpr const char* kPixelShader = R"(#version 140
in vec2 at; out vec4 color; uniform sampler2D skin;
void main() { color = vec4(texture(skin, at).rgb, 1.0); })";

void must(bool fine, const char* what) {
  if (!fine) throw Error(ExitCode::internal, std::string("llvmpipe: ") + what + " failed");
}

GLuint compiled(GLenum kind, const char* text) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint fine = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &fine);
  must(fine, "compiling a shader");
  return shader;
}

Eigen::Matrix4f clip_from_world(const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  constexpr double kFar_mm = 1e5;
  const double n = view.near_mm;
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip(0, 0) = 2 * k.fx / k.width, clip(0, 2) = 2 * k.cx / k.width - 1;
  clip(1, 1) = -2 * k.fy / k.height, clip(1, 2) = 1 - 2 * k.cy / k.height;
  clip(2, 2) = (kFar_mm + n) / (kFar_mm - n), clip(2, 3) = -2 * kFar_mm * n / (kFar_mm - n);
  clip(3, 2) = 1;
  Eigen::Matrix4d camera = Eigen::Matrix4d::Identity();
  camera.topLeftCorner<3, 3>() = view.camera.camera_from_world.rotation;
  camera.topRightCorner<3, 1>() = view.camera.camera_from_world.translation;
  return (clip * camera).cast<float>();
}

}  // namespace

struct SoftwareGl::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  GLuint program = 0, vertices = 0;
  GLsizei indices = 0;
  int width = 0, height = 0;
  std::vector<float> upload;

  void open();
  void make_target() const;
  void make_mesh(const SkinnedMesh& skinned);
};

void SoftwareGl::Impl::open() {
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  ::setenv("GALLIUM_DRIVER", "llvmpipe", 1);
  ::setenv("LP_NUM_THREADS", "0", 1);
  display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  must(display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr), "opening EGL");
  must(eglBindAPI(EGL_OPENGL_API), "asking for OpenGL");
  const EGLint config_attributes[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                      EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  must(eglChooseConfig(display, config_attributes, &config, 1, &count) && count > 0,
       "choosing a configuration");
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 1,
                               EGL_NONE};
  context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes);
  must(context != EGL_NO_CONTEXT, "making a context");
  must(eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context), "using the context");
}

void SoftwareGl::Impl::make_target() const {
  GLuint frame = 0, planes[2];
  glGenFramebuffers(1, &frame);
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  glGenRenderbuffers(2, planes);
  const GLenum formats[] = {GL_RGBA8, GL_DEPTH_COMPONENT24};
  const GLenum places[] = {GL_COLOR_ATTACHMENT0, GL_DEPTH_ATTACHMENT};
  for (int i = 0; i < 2; ++i) {
    glBindRenderbuffer(GL_RENDERBUFFER, planes[i]);
    glRenderbufferStorage(GL_RENDERBUFFER, formats[i], width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, places[i], GL_RENDERBUFFER, planes[i]);
  }
  must(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE, "making the picture");
  glViewport(0, 0, width, height);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CCW);
}

void SoftwareGl::Impl::make_mesh(const SkinnedMesh& skinned) {
  const TriangleMesh& mesh = skinned.mesh;
  program = glCreateProgram();
  glAttachShader(program, compiled(GL_VERTEX_SHADER, kVertexShader));
  glAttachShader(program, compiled(GL_FRAGMENT_SHADER, kPixelShader));
  glBindAttribLocation(program, 0, "position");
  glBindAttribLocation(program, 1, "texel");
  glLinkProgram(program);
  glUseProgram(program);
  GLuint array = 0, buffers[3], texture = 0;
  glGenVertexArrays(1, &array);
  glBindVertexArray(array);
  glGenBuffers(3, buffers);
  glBindBuffer(GL_ARRAY_BUFFER, buffers[1]);
  glBufferData(GL_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(skinned.texels.size() * sizeof(Eigen::Vector2f)),
               skinned.texels.data(), GL_STATIC_DRAW);
  glVertexAttribPointer(1, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[2]);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.faces.size() * sizeof(Face)),
               mesh.faces.data(), GL_STATIC_DRAW);
  indices = static_cast<GLsizei>(3 * mesh.faces.size());
  vertices = buffers[0];
  glBindBuffer(GL_ARRAY_BUFFER, vertices);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, skinned.skin.width, skinned.skin.height, 0, GL_RGB,
               GL_UNSIGNED_BYTE, skinned.skin.pixels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
}

SoftwareGl::SoftwareGl(const SkinnedMesh& skinned, int width, int height)
    : impl_(std::make_unique<Impl>()) {
  impl_->width = width;
  impl_->height = height;
  impl_->upload.resize(3 * skinned.mesh.vertices.size());
  impl_->open();
  impl_->make_target();
  impl_->make_mesh(skinned);
}

SoftwareGl::~SoftwareGl() {
  eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(impl_->display, impl_->context);
}

void SoftwareGl::draw(const std::vector<Eigen::Vector3d>& positions, const View& view) {
  Impl& m = *impl_;
  must(eglMakeCurrent(m.display, EGL_NO_SURFACE, EGL_NO_SURFACE, m.context), "using the context");
  for (std::size_t v = 0; v < positions.size(); ++v)
    for (int k = 0; k < 3; ++k) m.upload[3 * v + k] = static_cast<float>(positions[v][k]);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(m.upload.size() * sizeof(float)),
               m.upload.data(), GL_STREAM_DRAW);
  const Eigen::Matrix4f clip = clip_from_world(view);
  glUniformMatrix4fv(glGetUniformLocation(m.program, "clip_from_world"), 1, GL_FALSE, clip.data());
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glDrawElements(GL_TRIANGLES, m.indices, GL_UNSIGNED_INT, nullptr);
  glFinish();
}

std::string SoftwareGl::renderer() const {
  return reinterpret_cast<const char*>(glGetString(GL_RENDERER));
}

Rgb8Image SoftwareGl::picture() const {
  Rgb8Image upright(impl_->width, impl_->height), flipped = upright;
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, impl_->width, impl_->height, GL_RGB, GL_UNSIGNED_BYTE, flipped.pixels.data());
  for (int y = 0; y < upright.height; ++y)  // GL begins at the bottom
    std::copy_n(flipped.at(0, upright.height - 1 - y), 3 * upright.width, upright.at(0, y));
  return upright;
}

}  // namespace organbake
