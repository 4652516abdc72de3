# Installs the library into the build tree, builds examples/minimal against it as anyone would, and runs it on the sample.
foreach(name BUILD_DIR SOURCE_DIR CXX_COMPILER GENERATOR)
  if(NOT DEFINED ${name})
    message(FATAL_ERROR "-D${name}= is missing")
  endif()
endforeach()
set(work ${BUILD_DIR}/consumer)
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "exit ${code}: ${ARGN}\n${out}")
  endif()
  set(out "${out}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${work}/install)
run(${CMAKE_COMMAND} -S ${SOURCE_DIR}/examples/minimal -B ${work}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_PREFIX_PATH=${work}/install)
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/minimal ${SOURCE_DIR}/data/sample/map_front/video.mp4 525 120)

set(clip_out "${out}")
# The installed command finds its detector.
run(${CMAKE_COMMAND} -E env --unset=OASLAM_MODELS ${work}/install/bin/oaslam detect ${SOURCE_DIR}/data/sample/map_front/video.mp4 --to 1 --out ${work}/boxes.json)
set(out "${clip_out}")

# The clip must be tracked to its end, and give a map.
if(NOT out MATCHES "\n119 tracking ")
  message(FATAL_ERROR "the last frame was not tracked:\n${out}")
endif()
if(NOT out MATCHES "\n([0-9]+) keyframes, ([0-9]+) landmarks")
  message(FATAL_ERROR "no map:\n${out}")
endif()
if(CMAKE_MATCH_1 LESS 2 OR CMAKE_MATCH_2 LESS 100)
  message(FATAL_ERROR "a poor map: ${CMAKE_MATCH_1} keyframes, ${CMAKE_MATCH_2} landmarks")
endif()
