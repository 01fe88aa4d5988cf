// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "organbake/phantom/laparoscopy.h"

namespace organbake {

// phantom.json: what a phantom was made with.
std::string phantom_json(const std::string& options_json);

// The name that a frame's files bear: 000012.
std::string frame_number(int frame);

// What the frame shows, exactly, as EXR: depth (Z, and Y to look at), normals in camera axes, and
// the masks `highlight` and `instrument`.
void write_frame_truth(const std::filesystem::path& file, const LaparoscopyFrame& frame);

}  // namespace organbake
