// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace organbake {

// A file's ending in lower case, with its dot: ".png".
std::string lower_ending(const std::filesystem::path& file);

// PNG or JPEG by its name.
bool is_picture_name(const std::filesystem::path& file);
// These or EXR: what a frame of a clip may be.
bool is_frame_name(const std::filesystem::path& file);

// A surface mesh of any kind that is read, by its name.
bool is_mesh_name(const std::filesystem::path& file);

}  // namespace organbake
