// SPDX-License-Identifier: Apache-2.0
// EGL's devices are asked first, since a server's graphics hardware shows there alone; Mesa's
// surfaceless platform last.
#include <epoxy/egl.h>

#include <array>
#include <vector>

#include "organbake/graphics/graphics_drawing.h"

namespace organbake {
namespace {

std::vector<EGLDisplay> headless_displays() {
  std::vector<EGLDisplay> displays;
  if (!epoxy_has_egl()) return displays;
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (eglQueryDevicesEXT(devices.size(), devices.data(), &count))
      for (EGLint i = 0; i < count; ++i)
        displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
  }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
    displays.push_back(
        eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  return displays;
}

}  // namespace

std::optional<GraphicsDevice> OffscreenContext::open(EGLDisplay display, bool embedded) {
  EGLint major = 0, minor = 0, configs = 0;
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor)) return {};
  const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE,
                                        embedded ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  if (!eglChooseConfig(display, wanted.data(), &config, 1, &configs) || configs == 0) return {};
  eglBindAPI(embedded ? EGL_OPENGL_ES_API : EGL_OPENGL_API);
  // Of OpenGL the core profile, by default.
  const std::array<EGLint, 5> version = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION,
                                         embedded ? 0 : 3, EGL_NONE};
  display_ = display;
  context_ = eglCreateContext(display, config, EGL_NO_CONTEXT, version.data());
  if (context_ == EGL_NO_CONTEXT) return {};
  try {
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      return current_graphics_device();
  } catch (...) {
    close();
    throw;
  }
  close();
  return {};
}

void OffscreenContext::close() {
  if (context_ == EGL_NO_CONTEXT) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  context_ = EGL_NO_CONTEXT;
}

OffscreenContext::OffscreenContext(Kind kind) {
  const std::vector<EGLDisplay> displays = headless_displays();
  for (const bool takes_software : {false, true})
    for (const EGLDisplay display : displays) {
      const auto device = open(display, kind == Kind::embedded);
      if (device && (takes_software || !device->software)) return;
      close();
    }
  throw GraphicsError(
      "no graphics hardware answers without a display: EGL and a driver of OpenGL 3.3 are needed "
      "(on Debian libegl1 and libgl1-mesa-dri); draw with --draw cpu");
}

}  // namespace organbake
