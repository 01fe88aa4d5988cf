// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/volume/volume.h"

namespace organbake {

// MetaImage (.mha), int16, zlib-compressed, deterministic bytes. Throws IoError.
void write_metaimage(const std::filesystem::path& path, const Volume& volume);

}  // namespace organbake
