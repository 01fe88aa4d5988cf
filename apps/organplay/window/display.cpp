// SPDX-License-Identifier: Apache-2.0
#include "window/window.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl2.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "organbake/core/error.h"

namespace organbake {
namespace {

std::string glfw_reason() {
  const char* reason = nullptr;
  ::glfwGetError(&reason);
  return reason ? std::string(" (") + reason + ")" : "";
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value && *value;
}

// A vector font of the system's, which most have one of; else empty.
std::string system_font() {
  for (const char* path : {"/usr/share/fonts/truetype/dejavu/DejaVuSansCondensed.ttf",
                           "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                           "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf",
                           "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
                           "/usr/share/fonts/truetype/freefont/FreeSans.ttf"}) {
    std::error_code unreadable;
    if (std::filesystem::is_regular_file(path, unreadable)) return path;
  }
  return {};
}

// Started and ended with the window: a program has one.
struct Glfw {
  Glfw() {
    // GLFW 3.4 tries Wayland where nothing names a display, and its library writes to stderr.
    if ((is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) && ::glfwInit()) return;
    throw UsageError("no display to open a window on" + glfw_reason() +
                     "; without one, give --script with --out, --view-deg with -o, --sheet, "
                     "--compare or --bench");
  }
  ~Glfw() { ::glfwTerminate(); }
};

}  // namespace

struct Display::Impl {
  Glfw glfw;
  GLFWwindow* window = nullptr;
  GLuint texture = 0;
  Eigen::Vector2i picture_size = Eigen::Vector2i::Zero();
  Eigen::Vector2i picture_corner = Eigen::Vector2i::Zero();
  Eigen::Vector4i before_full_screen;  // x, y, width, height
  double letters = 0;                  // the scale that they were made for
  std::function<void(const Rgb8Image&)> take;
  std::vector<int> pressed;  // GLFW's names of keys since the last frame
};

Display::Display(const std::string& title, int width, int height)
    : impl_(std::make_unique<Impl>()) {
  impl_->window = ::glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (!impl_->window) throw UsageError("no window can be opened" + glfw_reason());
  ::glfwMakeContextCurrent(impl_->window);
  ::glfwSwapInterval(1);
  ::glfwSetWindowUserPointer(impl_->window, impl_.get());
  // ImGui calls it on when it puts its own in its place.
  ::glfwSetKeyCallback(impl_->window, [](GLFWwindow* window, int key, int, int action, int) {
    if (action != GLFW_PRESS) return;
    static_cast<Impl*>(::glfwGetWindowUserPointer(window))->pressed.push_back(key);
  });
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves nothing in the user's folder
  ImGui_ImplGlfw_InitForOpenGL(impl_->window, true);
  ImGui_ImplOpenGL2_Init();
  ::glGenTextures(1, &impl_->texture);
  ::glBindTexture(GL_TEXTURE_2D, impl_->texture);
  ::glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  ::glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

Display::~Display() {
  if (!impl_->window) return;
  ImGui_ImplOpenGL2_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  ::glfwDestroyWindow(impl_->window);
}

bool Display::begin_frame() {
  impl_->pressed.clear();
  ::glfwPollEvents();
  if (::glfwWindowShouldClose(impl_->window)) return false;
  fit_letters();
  ImGui_ImplOpenGL2_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  if (impl_->picture_size.x() > 0) {
    const Eigen::Vector2f from = impl_->picture_corner.cast<float>();
    const Eigen::Vector2f to = from + impl_->picture_size.cast<float>();
    ImGui::GetBackgroundDrawList()->AddImage(
        reinterpret_cast<ImTextureID>(std::uintptr_t(impl_->texture)), {from.x(), from.y()},
        {to.x(), to.y()});
  }
  return true;
}

void Display::end_frame() {
  ImGui::Render();
  const Eigen::Vector2i size = size_px();
  ::glViewport(0, 0, size.x(), size.y());
  ::glClearColor(0.09f, 0.09f, 0.1f, 1);
  ::glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL2_RenderDrawData(ImGui::GetDrawData());
  if (impl_->take) impl_->take(drawn_window());
  impl_->take = nullptr;
  ::glfwSwapBuffers(impl_->window);
}

bool Display::pressed(char key) const {
  if (ImGui::GetIO().WantTextInput) return false;
  const int wanted = key == kEscape  ? GLFW_KEY_ESCAPE
                     : key == kEnter ? GLFW_KEY_ENTER
                     : key == kF11   ? GLFW_KEY_F11
                                     : key;  // the others are their own names
  return std::count(impl_->pressed.begin(), impl_->pressed.end(), wanted) > 0;
}

void Display::ask_to_close() { ::glfwSetWindowShouldClose(impl_->window, GLFW_TRUE); }

Eigen::Vector2i Display::size_px() const {
  int width = 0, height = 0;
  ::glfwGetFramebufferSize(impl_->window, &width, &height);
  return {std::max(1, width), std::max(1, height)};
}

double Display::scale() const {
  float x = 1, y = 1;
  ::glfwGetWindowContentScale(impl_->window, &x, &y);
  return panel_scale(size_px(), double(std::max(x, y)));
}

// Letters are made anew where they have to be larger: enlarged ones would be blurred. ImGui's own,
// of fixed pixels, where the system has none that it can read.
void Display::fit_letters() {
  const double wanted = scale();
  if (wanted == impl_->letters) return;
  impl_->letters = wanted;
  ImGuiStyle style;
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = 0;
  style.WindowBorderSize = 0;
  style.ScaleAllSizes(float(wanted));
  ImGui::GetStyle() = style;
  constexpr double kLetters_px = 15, kOwnLetters_px = 13;
  ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  atlas.Clear();
  const std::string font = system_font();
  if (font.empty() ||
      !atlas.AddFontFromFileTTF(font.c_str(), float(std::floor(kLetters_px * wanted)))) {
    ImFontConfig own;
    own.SizePixels = float(std::floor(kOwnLetters_px * wanted));
    atlas.AddFontDefault(&own);
  }
  ImGui_ImplOpenGL2_DestroyFontsTexture();
  ImGui_ImplOpenGL2_CreateFontsTexture();
}

void Display::toggle_full_screen() {
  Eigen::Vector4i& kept = impl_->before_full_screen;
  if (::glfwGetWindowMonitor(impl_->window)) {
    ::glfwSetWindowMonitor(impl_->window, nullptr, kept[0], kept[1], kept[2], kept[3], 0);
    return;
  }
  GLFWmonitor* monitor = ::glfwGetPrimaryMonitor();
  const GLFWvidmode* mode = monitor ? ::glfwGetVideoMode(monitor) : nullptr;
  if (!mode) return;
  ::glfwGetWindowPos(impl_->window, &kept[0], &kept[1]);
  ::glfwGetWindowSize(impl_->window, &kept[2], &kept[3]);
  ::glfwSetWindowMonitor(impl_->window, monitor, 0, 0, mode->width, mode->height,
                         mode->refreshRate);
}

void Display::move_picture(const Eigen::Vector2i& corner_px) { impl_->picture_corner = corner_px; }

void Display::hide_picture() { impl_->picture_size.setZero(); }

void Display::set_picture(const Rgb8Image& picture, const Eigen::Vector2i& corner_px) {
  move_picture(corner_px);
  ::glBindTexture(GL_TEXTURE_2D, impl_->texture);
  ::glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  const Eigen::Vector2i size(picture.width, picture.height);
  if (size == impl_->picture_size) {
    ::glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size.x(), size.y(), GL_RGB, GL_UNSIGNED_BYTE,
                      picture.pixels.data());
  } else {
    ::glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, size.x(), size.y(), 0, GL_RGB, GL_UNSIGNED_BYTE,
                   picture.pixels.data());
  }
  impl_->picture_size = size;
}

void Display::read_back(std::function<void(const Rgb8Image&)> take) {
  impl_->take = std::move(take);
}

Rgb8Image Display::drawn_window() const {
  const Eigen::Vector2i size = size_px();
  Rgb8Image upside_down(size.x(), size.y()), result(size.x(), size.y());
  ::glPixelStorei(GL_PACK_ALIGNMENT, 1);
  ::glReadPixels(0, 0, size.x(), size.y(), GL_RGB, GL_UNSIGNED_BYTE, upside_down.pixels.data());
  const std::size_t row = std::size_t(3) * size.x();
  for (int y = 0; y < size.y(); ++y) {
    std::copy_n(upside_down.at(0, size.y() - 1 - y), row, result.at(0, y));
  }
  return result;
}

}  // namespace organbake
