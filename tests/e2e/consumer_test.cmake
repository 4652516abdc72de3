# Installs the library into the build tree, builds the examples against it as anyone would, and runs them on the sample.
foreach(name BUILD_DIR SOURCE_DIR CXX_COMPILER GENERATOR SHARED)
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

# The public headers are installed, and no others.
file(GLOB_RECURSE installed RELATIVE ${work}/install/include ${work}/install/include/*)
set(public "")
foreach(part core viewer)
  file(GLOB_RECURSE headers RELATIVE ${SOURCE_DIR}/${part}/include ${SOURCE_DIR}/${part}/include/*.h)
  list(APPEND public ${headers})
endforeach()
list(SORT public)
if(NOT installed STREQUAL public)
  message(FATAL_ERROR "installed headers: ${installed}\npublic headers: ${public}")
endif()

# Who links the shared library needs nothing of what is behind it.
set(without "")
if(SHARED)
  foreach(package Ceres hwy nlohmann_json yaml-cpp fmt SQLiteCpp PkgConfig Threads Boost OpenSSL CURL)
    list(APPEND without -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
  endforeach()
endif()
run(${CMAKE_COMMAND} -S ${SOURCE_DIR}/examples -B ${work}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_PREFIX_PATH=${work}/install ${without})
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/minimal/minimal ${SOURCE_DIR}/data/sample/map_front/video.mp4 525 120)
set(clip_out "${out}")

# The other examples: each prints where it is, and draws or finds something.
set(clip ${SOURCE_DIR}/data/sample/map_front)
function(expect pattern)
  if(NOT out MATCHES "${pattern}")
    message(FATAL_ERROR "${pattern}: not in\n${out}")
  endif()
endfunction()
run(${work}/build/ar_anchors ${clip}/video.mp4 ${clip}/camera.yaml ${work}/ar.png 100)
expect("\n99 [0-9]+ [0-9]+\n")  # the anchor is still in view
run(${CMAKE_COMMAND} -E env OASLAM_MODELS=$ENV{OASLAM_DATA}/models
  ${work}/build/live_camera ${clip}/video.mp4 ${clip}/camera.yaml ${work}/live.png 4)
expect("[1-9][0-9]* keyframes in the end")
run(${work}/install/bin/oaslam run --images ${clip}/video.mp4 --camera ${clip}/camera.yaml --to 100 --out ${work}/run --map-out ${work}/desk.map)
run(${work}/build/localize_many ${work}/desk.map ${clip}/video.mp4 ${clip}/camera.yaml)
expect("000050 -?[0-9.]+ -?[0-9.]+ -?[0-9.]+\n000051 ")  # in order
foreach(picture ar live)
  if(NOT EXISTS ${work}/${picture}.png)
    message(FATAL_ERROR "no ${picture}.png")
  endif()
endforeach()
execute_process(COMMAND ${work}/build/localize_many ${work}/no.map ${clip}/video.mp4 RESULT_VARIABLE code ERROR_VARIABLE out)
expect("no.map")  # InputError crosses the boundary of the library
if(NOT code EQUAL 1)
  message(FATAL_ERROR "exit ${code} instead of 1")
endif()

# The same program built without CMake.
find_program(PKG_CONFIG pkg-config)
if(SHARED AND PKG_CONFIG)
  file(GLOB_RECURSE pc ${work}/install/oaslam.pc)
  get_filename_component(pc_dir ${pc} DIRECTORY)
  run(${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${pc_dir} ${PKG_CONFIG} --cflags --libs oaslam)
  separate_arguments(flags UNIX_COMMAND "${out}")
  get_filename_component(lib_dir ${pc_dir} DIRECTORY)
  run(${CXX_COMPILER} -std=c++20 ${SOURCE_DIR}/examples/minimal/main.cc -o ${work}/minimal ${flags} -lopencv_imgproc -lopencv_videoio -Wl,-rpath,${lib_dir})
  run(${work}/minimal ${SOURCE_DIR}/data/sample/map_front/video.mp4 525 120)
  if(NOT out STREQUAL clip_out)
    message(FATAL_ERROR "pkg-config's program says something else:\n${out}")
  endif()
endif()

# The installed command finds the detectors of its prefix.
if(EXISTS $ENV{OASLAM_DATA}/models/yolox_nano.onnx)
  file(COPY $ENV{OASLAM_DATA}/models DESTINATION ${work}/install/share/oaslam)
  run(${CMAKE_COMMAND} -E env --unset=OASLAM_MODELS XDG_DATA_HOME=${work}
    ${work}/install/bin/oaslam detect ${SOURCE_DIR}/data/sample/map_front/video.mp4 --to 1 --out ${work}/boxes.json)
else()
  message("skipped: the installed command with a detector (models/yolox_nano.onnx under OASLAM_DATA)")
endif()
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
