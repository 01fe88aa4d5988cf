// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fuzz/readers.h"

class vtkXMLWriter;

namespace organbake {

// The writer's input as VTK writes it: as text, as base64, appended; packed or not; in both orders
// of bytes; with short and with long counts.
Seeds vtk_writings(vtkXMLWriter& writer);

// The same packed as is not read.
std::string vtk_lz4_writing(vtkXMLWriter& writer);

}  // namespace organbake
