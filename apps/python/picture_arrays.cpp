// SPDX-License-Identifier: Apache-2.0
#include "picture_arrays.h"

#include <utility>
#include <vector>

namespace organbake {
namespace py = pybind11;
namespace {

using Owner = std::shared_ptr<DrawnPicture>;

// Keeps the picture as long as the array lives.
py::capsule keeper(const Owner& owner) {
  return py::capsule(new Owner(owner), [](void* kept) { delete static_cast<Owner*>(kept); });
}

// A plane of `of` numbers a pixel over the picture's memory; none: one number, no third axis.
template <class Number>
py::object plane(const Owner& owner, const void* first, int of = 0) {
  const py::ssize_t height = owner->truth.height > 0 ? owner->truth.height : owner->color.height,
                    width = owner->truth.width > 0 ? owner->truth.width : owner->color.width;
  std::vector<py::ssize_t> shape{height, width};
  if (of > 0) shape.push_back(of);
  return py::array_t<Number>(shape, static_cast<const Number*>(first), keeper(owner));
}

}  // namespace

PictureArrays::PictureArrays(DrawnPicture picture, py::object rgb)
    : picture_(std::make_shared<DrawnPicture>(std::move(picture))), rgb_(std::move(rgb)) {}

py::object PictureArrays::rgb() const {
  if (!rgb_.is_none()) return rgb_;
  return plane<std::uint8_t>(picture_, picture_->color.pixels.data(), 3);
}

py::object PictureArrays::depth_mm() const {
  if (!picture_->layers.depth) return py::none();
  return plane<float>(picture_, picture_->truth.depth_mm.data());
}

py::object PictureArrays::normals() const {
  if (!picture_->layers.normals) return py::none();
  return plane<float>(picture_, picture_->truth.normal.data(), 3);
}

py::object PictureArrays::mask() const {
  if (!picture_->layers.mask) return py::none();
  return plane<std::uint8_t>(picture_, picture_->truth.label.data());
}

py::object PictureArrays::skin() const {
  if (!picture_->layers.id) return py::none();
  static_assert(sizeof(BoundPixel) == 24);
  const auto offset = [](auto BoundPixel::*member) {
    static const BoundPixel pixel;
    return py::int_(reinterpret_cast<const char*>(&(pixel.*member)) -
                    reinterpret_cast<const char*>(&pixel));
  };
  py::list names, formats, offsets;
  const auto field = [&](const char* name, const char* format, const py::int_& at) {
    names.append(name), formats.append(format), offsets.append(at);
  };
  field("face", "u4", offset(&BoundPixel::face));
  field("b1", "f4", offset(&BoundPixel::b1));
  field("b2", "f4", offset(&BoundPixel::b2));
  field("height_mm", "f4", offset(&BoundPixel::height_mm));
  const py::dtype type(names, formats, offsets, sizeof(BoundPixel));
  return py::array(type, {py::ssize_t(picture_->truth.height), py::ssize_t(picture_->truth.width)},
                   picture_->truth.bound.data(), keeper(picture_));
}

py::object PictureArrays::organ() const {
  if (!picture_->layers.id || picture_->truth.organ.empty()) return py::none();
  return plane<std::uint8_t>(picture_, picture_->truth.organ.data());
}

py::object PictureArrays::weight() const {
  if (!picture_->layers.weight) return py::none();
  const PixelTruth& truth = picture_->truth;
  const py::ssize_t row = py::ssize_t(sizeof(BoundPixel)) * truth.width;
  return py::array(py::dtype::of<float>(), {py::ssize_t(truth.height), py::ssize_t(truth.width)},
                   {row, py::ssize_t(sizeof(BoundPixel))}, &truth.bound.data()->weight,
                   keeper(picture_));
}

py::object PictureArrays::flow_back() const {
  if (!picture_->has_flow) return py::none();
  return plane<float>(picture_, picture_->backward.px.data(), 2);
}
py::object PictureArrays::flow_back_seen() const {
  if (!picture_->has_flow) return py::none();
  return plane<bool>(picture_, picture_->backward.seen.data());
}
py::object PictureArrays::flow_from_last() const {
  if (!picture_->has_flow) return py::none();
  return plane<float>(picture_, picture_->forward.px.data(), 2);
}
py::object PictureArrays::flow_from_last_seen() const {
  if (!picture_->has_flow) return py::none();
  return plane<bool>(picture_, picture_->forward.seen.data());
}

}  // namespace organbake
