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

}  // namespace organbake
