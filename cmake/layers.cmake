# Functions for the CMakeLists.txt of src/ and extras/.

# Compiles several sources of a target as one, which reads headers once: half the time. Names in
# their unnamed namespaces have to differ.
function(upswing_unity)
  set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 12)
endfunction()

# Compiles targets in two thirds of the time: tests, commands and layers whose slow code is in other
# layers.
function(upswing_quickly)
  foreach(NAME IN LISTS ARGN)
    target_compile_options(${NAME} PRIVATE $<$<CONFIG:Release>:-O1>)
  endforeach()
endfunction()

# One library for each layer, a folder, with the tests next to its files.
# upswing_layer(NAME SOURCES … TESTS … PUBLIC … PRIVATE …)
function(upswing_layer name)
  cmake_parse_arguments(ARG "" "" "SOURCES;TESTS;PUBLIC;PRIVATE" ${ARGN})
  foreach(FILES IN ITEMS SOURCES TESTS)
    list(TRANSFORM ARG_${FILES} PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/${name}/)
  endforeach()
  add_library(upswing_${name} STATIC ${ARG_SOURCES})
  set_target_properties(upswing_${name} PROPERTIES EXPORT_NAME ${name})
  upswing_unity(upswing_${name})
  target_compile_features(upswing_${name} PUBLIC cxx_std_20)
  if(NOT name MATCHES "^(nn|pendulum|rl|control|realaigym)$")
    target_compile_options(upswing_${name} PRIVATE ${UPSWING_HARDENED})
  endif()
  target_include_directories(upswing_${name} PUBLIC $<BUILD_INTERFACE:${UPSWING_INCLUDE}>
                                                    $<INSTALL_INTERFACE:include/upswing>)
  target_link_libraries(upswing_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  if(UPSWING_TESTS AND ARG_TESTS)
    add_executable(${name}_test ${ARG_TESTS})
    upswing_unity(${name}_test)
    upswing_quickly(${name}_test)
    target_link_libraries(${name}_test PRIVATE upswing_${name} ${ARG_PRIVATE} GTest::gtest_main)
    # With ccache's base_dir, __FILE__ is relative to the build folder; tests find their data there.
    gtest_discover_tests(${name}_test TEST_PREFIX ${name}. WORKING_DIRECTORY ${CMAKE_BINARY_DIR}
                         NO_PRETTY_VALUES DISCOVERY_MODE PRE_TEST)
  endif()
endfunction()

# Adds the code of a file format to a layer: upswing_proto(LAYER NAME) reads LAYER/NAME.proto.
function(upswing_proto layer name)
  protobuf_generate_cpp(PROTO_SOURCES PROTO_HEADERS ${layer}/${name}.proto)
  # No warnings for generated code.
  add_library(upswing_${name}_proto STATIC ${PROTO_SOURCES} ${PROTO_HEADERS})
  set_target_properties(upswing_${name}_proto PROPERTIES EXPORT_NAME ${name}_proto)
  target_include_directories(upswing_${name}_proto SYSTEM PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_BINARY_DIR}>)
  target_link_libraries(upswing_${name}_proto PUBLIC protobuf::libprotobuf-lite)
  target_link_libraries(upswing_${layer} PRIVATE upswing_${name}_proto)
  if(NOT WIN32)
    install(TARGETS upswing_${name}_proto EXPORT upswing)
  endif()
endfunction()

# Sets the variable ENTRIES to the TOML files of a folder as C++: a name and a text each.
function(upswing_toml_entries FOLDER ENTRIES)
  file(GLOB FILES ${PROJECT_SOURCE_DIR}/${FOLDER}/*.toml)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${FOLDER} ${FILES})
  set(TEXT "")
  foreach(FILE IN LISTS FILES)
    get_filename_component(NAME ${FILE} NAME_WE)
    file(READ ${FILE} TOML)
    string(APPEND TEXT "    {\"${NAME}\", R\"toml(${TOML})toml\"},\n")
  endforeach()
  set(${ENTRIES} "${TEXT}" PARENT_SCOPE)
endfunction()

# Seconds after which a test counts as hanging: for a machine twenty times slower than two idle cores.
set(UPSWING_TEST_TIMEOUT 7200)

# A test that is a Python program (standard library only); it finds the program in UPSWING.
function(upswing_python_test name script)
  add_test(NAME ${name} COMMAND Python3::Interpreter -B ${PROJECT_SOURCE_DIR}/${script}
           ${ARGN})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${UPSWING_TEST_TIMEOUT} ENVIRONMENT
    "UPSWING=${CMAKE_BINARY_DIR}/bin/upswing;UPSWING_ROOT=${PROJECT_SOURCE_DIR};${UPSWING_SANITIZED};${UPSWING_FINGERPRINTS};UPSWING_EMULATOR=${CMAKE_CROSSCOMPILING_EMULATOR}")
endfunction()
