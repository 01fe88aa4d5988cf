// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// Reading a bundle takes and frees some hundred megabytes. What malloc takes from the system anew
// costs a page fault every 4 KB, several microseconds each on a virtual machine: up to two thirds
// of a start. After this call freed memory is kept, and the heap asks for pages of 2 MB. For the
// first line of a program's main: it is the whole process's malloc. Does nothing where the C
// library is not glibc, and no harm where the system refuses.
void keep_heap_in_large_pages();

}  // namespace organbake
