# How programs and the Python module are linked.

if(WIN32)
  # A program brings the libraries of the compiler, and the same sources give the same bits.
  add_link_options(-static -fstack-protector-strong -Wl,--no-insert-timestamp)
  # Windows aligns the stack to 16 bytes only, and g++ stores vectors of 32 and 64 bytes there as if they were
  # aligned (GCC's bug 54412). The assembler turns these instructions into those for any address.
  add_compile_options(-Wa,-muse-unaligned-vector-move)
elseif(NOT APPLE)
  # Hardening: addresses of functions are read-only (full RELRO). A build ID would depend on the folder
  # that a program is built in.
  add_link_options(-Wl,-z,relro,-z,now -Wl,--build-id=none)
endif()

# The folders in which an installed target looks for shared libraries. Only the built one looks where this
# machine has MuJoCo, too. CMake's own change of a run path is not used: it ends the built one with empty
# entries, and the loader takes them for the current folder, where anyone's library may lie.
#
# upswing_install_run_path(TARGET FOLDER PATHS … INSTALL …), with FOLDER below the prefix, PATHS relative
# to $ORIGIN, and INSTALL as for install()
function(upswing_install_run_path target folder)
  if(WIN32)  # looks in the folder of the program
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "PATHS;INSTALL" ${ARGN})
  set(MUJOCO $<TARGET_FILE_DIR:mujoco::mujoco>)
  if(NOT mujoco_FOUND)
    # Of one length, so that the installed bits do not depend on the folder of the build.
    set(MUJOCO "${UPSWING_MUJOCO}/lib")
    string(LENGTH "${MUJOCO}" LENGTH)
    if(LENGTH LESS 200)
      math(EXPR MISSING "200 - ${LENGTH}")
      string(REPEAT / ${MISSING} SLASHES)
      string(APPEND MUJOCO ${SLASHES})
    endif()
  endif()
  list(JOIN ARG_PATHS : INSTALLED)
  set(BUILT "${INSTALLED}:${MUJOCO}")
  set_target_properties(${target} PROPERTIES BUILD_WITH_INSTALL_RPATH ON INSTALL_RPATH "${BUILT}")
  set(FILE "\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${folder}/$<TARGET_FILE_NAME:${target}>")
  install(CODE "file(RPATH_CHANGE FILE \"${FILE}\" OLD_RPATH [[${BUILT}]] NEW_RPATH [[${INSTALLED}]])"
          ${ARG_INSTALL})
endfunction()
