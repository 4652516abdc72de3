# Makes a text file part of a target, as the string that a function returns. `header` declares it, in namespace oaslam:
# std::string_view NAME();
function(oaslam_embed_page target name header file)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} rest HEX)
  string(LENGTH "${rest}" digits)
  math(EXPR bytes "${digits} / 2")
  file(READ ${file} rest)
  string(LENGTH "${rest}" length)
  if(NOT length EQUAL bytes)
    message(FATAL_ERROR "${file}: not plain ASCII text")
  endif()
  # Compilers bound the length of one literal; adjacent ones are joined.
  set(literals "")
  set(step 15000)
  foreach(begin RANGE 0 ${length} ${step})
    string(SUBSTRING "${rest}" ${begin} ${step} part)
    string(APPEND literals "R\"oaslam(${part})oaslam\"\n")
  endforeach()
  set(source ${PROJECT_BINARY_DIR}/generated/${name}.cc)
  file(CONFIGURE OUTPUT ${source} CONTENT [=[
#include "@header@"

namespace oaslam {

std::string_view @name@() {
  static constexpr char kPage[] =
@literals@;
  return {kPage, sizeof(kPage) - 1};
}

}  // namespace oaslam
]=] @ONLY)
  target_sources(${target} PRIVATE ${source})
endfunction()
