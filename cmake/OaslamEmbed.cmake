# oaslam_embed(TARGET NAME HEADER FILE): makes a file part of a target, as the bytes that a function returns. The header
# declares it, in namespace oaslam: std::string_view NAME();
function(oaslam_embed target name header file)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
  set(source ${CMAKE_BINARY_DIR}/generated/${name}.cc)
  file(CONFIGURE OUTPUT ${source} CONTENT [=[
#include "@header@"

namespace oaslam {

std::string_view @name@() {
  static constexpr unsigned char kBytes[] = {@bytes@};
  return {reinterpret_cast<const char*>(kBytes), sizeof(kBytes)};
}

}  // namespace oaslam
]=] @ONLY)
  target_sources(${target} PRIVATE ${source})
  # Alone, so that a sanitized room can take it from the other (OaslamRooms.cmake).
  set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# oaslam_embed_page(TARGET NAME HEADER FILE): the same, compressed by gzip.
function(oaslam_embed_page target name header file)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  set(gzipped ${CMAKE_BINARY_DIR}/generated/${name}.gz)
  file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/generated)
  # Without the name and time of the file, so that the same document is the same bytes.
  execute_process(COMMAND gzip -9nc ${file} OUTPUT_FILE ${gzipped} COMMAND_ERROR_IS_FATAL ANY)
  oaslam_embed(${target} ${name} ${header} ${gzipped})
endfunction()
