// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "gl_names.h"

namespace organbake {

// A texture of a picture's size, or one of its layers, to draw into and to read.
class Target {
 public:
  // Of four bytes, a float, two words, a byte.
  enum class Kind : std::uint8_t { color, depth, key, edges };

  Target(Kind kind, int layers = 0) : kind_(kind), layers_(layers) {}  // 0: no array
  void resize(int width, int height);
  unsigned texture() const { return texture_.name(); }
  unsigned target() const;
  // To the framebuffer that is bound.
  void attach(int layer = 0) const;

 private:
  Kind kind_;
  int layers_;
  TextureName texture_;
};

// All that a picture of one size is drawn into.
struct Targets {
  static constexpr int kLayers = 3;  // cameras of a view
  // A picture and the depth of its skin.
  struct Picture {
    Target color{Target::Kind::color}, depth{Target::Kind::depth};
    FramebufferName framebuffer;
  };

  int width = 0, height = 0;
  Target keys{Target::Kind::key, kLayers}, depths{Target::Kind::depth, kLayers};
  std::array<FramebufferName, kLayers> layers;
  Target base_bound{Target::Kind::key}, base_depth{Target::Kind::depth};
  FramebufferName base;
  Picture resolved;
  std::array<Picture, 2> finished;  // turn about
  Target edges{Target::Kind::edges};
  FramebufferName edge_picture;

  void resize(int new_width, int new_height);
};

// The largest splat of each face, as a table.
class Stretches {
 public:
  void resize(int faces);
  int rows() const { return rows_; }
  void begin() const;  // binds it, empty
  unsigned table() const { return color_.texture(); }

 private:
  Target color_{Target::Kind::color};
  FramebufferName framebuffer_;
  int rows_ = 0;
};

}  // namespace organbake
