# The libraries of cmake/libraries.cmake for Windows, which Debian has no packages of, except zlib. Libraries of headers
# only are this system's. The others are compiled from the sources of the same versions.
set(UPSWING_DEPS ${PROJECT_SOURCE_DIR}/build/deps)

# upswing_fetch(NAME VARIABLE): fetches the source NAME and sets VARIABLE to its folder.
function(upswing_fetch name variable)
  file(STRINGS ${PROJECT_SOURCE_DIR}/tools/${name}-requirements.txt PIN REGEX " @ ")
  string(REGEX REPLACE ".*_([0-9.]*[0-9]).*" "\\1" VERSION "${PIN}")
  set(FOLDER ${UPSWING_DEPS}/${name}-${VERSION})
  execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/fetch_wheel ${name} ${FOLDER}
                  RESULT_VARIABLE FAILED)
  if(FAILED)
    message(FATAL_ERROR "${name} could not be fetched (see above)")
  endif()
  set(${variable} ${FOLDER} PARENT_SCOPE)
endfunction()

# upswing_library(ALIAS INCLUDES FOLDER SOURCE…): a static library with the sources in FOLDER, without
# warnings. Without sources, only headers.
function(upswing_library alias includes)
  string(REGEX REPLACE "[^A-Za-z0-9]+" "_" NAME "windows_${alias}")
  if(ARGN)
    add_library(${NAME} STATIC ${ARGN})
    target_include_directories(${NAME} SYSTEM PUBLIC ${includes})
    target_compile_options(${NAME} PRIVATE -w)
  else()
    add_library(${NAME} INTERFACE)
    target_include_directories(${NAME} SYSTEM INTERFACE ${includes})
  endif()
  add_library(${alias} ALIAS ${NAME})
endfunction()

# Headers of this system, in a folder without those of its C library.
set(HEADERS ${CMAKE_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${HEADERS})
foreach(NAME IN ITEMS CLI fmt nlohmann toml++)
  if(NOT EXISTS /usr/include/${NAME})
    message(FATAL_ERROR "expected the headers /usr/include/${NAME}, found none")
  endif()
  file(CREATE_LINK /usr/include/${NAME} ${HEADERS}/${NAME} SYMBOLIC)
endforeach()
foreach(ALIAS IN ITEMS fmt::fmt nlohmann_json::nlohmann_json CLI11::CLI11 tomlplusplus::tomlplusplus)
  upswing_library(${ALIAS} ${HEADERS})
endforeach()
target_compile_definitions(windows_fmt_fmt INTERFACE FMT_HEADER_ONLY=1)
upswing_library(Eigen3::Eigen /usr/include/eigen3)

upswing_fetch(highway-source HIGHWAY)
upswing_library(PkgConfig::HWY ${HIGHWAY} ${HIGHWAY}/hwy/aligned_allocator.cc ${HIGHWAY}/hwy/per_target.cc
  ${HIGHWAY}/hwy/targets.cc)

upswing_fetch(muparser MUPARSER)
foreach(PART IN ITEMS "" Base Bytecode Callback Error TokenReader)
  list(APPEND MUPARSER_SOURCES ${MUPARSER}/src/muParser${PART}.cpp)
endforeach()
upswing_library(PkgConfig::MUPARSER ${MUPARSER}/include ${MUPARSER_SOURCES})
target_compile_definitions(windows_PkgConfig_MUPARSER PUBLIC MUPARSER_STATIC)

upswing_fetch(protobuf PROTOBUF)
set(PROTOBUF ${PROTOBUF}/src)
foreach(PART IN ITEMS any_lite arena arenastring arenaz_sampler extension_set generated_enum_util
        generated_message_tctable_lite generated_message_util implicit_weak_message
        inlined_string_field io/coded_stream io/io_win32 io/strtod io/zero_copy_stream
        io/zero_copy_stream_impl io/zero_copy_stream_impl_lite map message_lite parse_context
        repeated_field repeated_ptr_field stubs/bytestream stubs/common stubs/int128 stubs/status
        stubs/statusor stubs/stringpiece stubs/stringprintf stubs/structurally_valid stubs/strutil
        stubs/time wire_format_lite)
  list(APPEND PROTOBUF_SOURCES ${PROTOBUF}/google/protobuf/${PART}.cc)
endforeach()
upswing_library(protobuf::libprotobuf-lite ${PROTOBUF} ${PROTOBUF_SOURCES})
# protoc runs on this system. The module has the function protobuf_generate_cpp.
find_program(Protobuf_PROTOC_EXECUTABLE protoc REQUIRED)
set(Protobuf_INCLUDE_DIR ${PROTOBUF})
set(Protobuf_LIBRARIES protobuf::libprotobuf-lite)
find_package(Protobuf QUIET MODULE)
find_library(UPSWING_ZLIB libz.a REQUIRED)  # of libz-mingw-w64-dev; zlib1.dll is next to it
set(ZLIB_LIBRARY ${UPSWING_ZLIB})
find_package(ZLIB REQUIRED)
