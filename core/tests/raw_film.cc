// raw_film VIDEO TO: writes the grey pixels of its first images to standard output, for programs
// that read no videos.
#include <cstdio>
#include <cstdlib>

#include "oaslam/image_source.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto source = oaslam::OpenImages(argv[1], {.to = std::atoi(argv[2])});
  while (const auto input = source->Next())
    for (int y = 0; y < input->image.rows; ++y)
      if (std::fwrite(input->image.ptr(y), 1, static_cast<size_t>(input->image.cols), stdout) !=
          static_cast<size_t>(input->image.cols))
        return 1;
}
