// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>

#include "shared_player.h"

namespace organbake {

// A picture as Python sees it: every attribute is an array over memory that the picture owns and
// keeps alive as long as any of them is in use. Nothing is copied.
class PictureArrays {
 public:
  explicit PictureArrays(DrawnPicture picture, pybind11::object rgb);

  pybind11::object rgb() const;
  pybind11::object depth_mm() const;  // None unless asked for, as the others
  pybind11::object normals() const;
  pybind11::object mask() const;
  pybind11::object skin() const;  // a structured array
  pybind11::object organ() const;
  pybind11::object weight() const;
  pybind11::object flow_back() const;  // None at a first picture, too
  pybind11::object flow_back_seen() const;
  pybind11::object flow_from_last() const;
  pybind11::object flow_from_last_seen() const;

 private:
  std::shared_ptr<DrawnPicture> picture_;
  pybind11::object rgb_;  // the caller's own array, or None
};

}  // namespace organbake
