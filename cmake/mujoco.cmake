# MuJoCo 4.0.0 as mujoco::mujoco: an installed release where there is one, else the official wheel,
# in the folder UPSWING_MUJOCO. Installed, this file is part of the package upswing, which has it.
find_package(mujoco 4.0.0 CONFIG QUIET)
if(NOT mujoco_FOUND)
  set(UPSWING_MUJOCO_FILE libmujoco.so.4.0.0)
  if(WIN32)
    set(UPSWING_MUJOCO_FILE mujoco.dll)
  endif()
  if(NOT UPSWING_MUJOCO)
    set(UPSWING_MUJOCO ${PROJECT_SOURCE_DIR}/build/deps/mujoco-4.0.0)
    if(WIN32)
      set(UPSWING_MACHINE windows)
    else()
      set(UPSWING_MACHINE ${CMAKE_SYSTEM_PROCESSOR})
    endif()
    if(CMAKE_CROSSCOMPILING)
      string(APPEND UPSWING_MUJOCO -${UPSWING_MACHINE})
    endif()
    if(NOT EXISTS ${UPSWING_MUJOCO}/lib/${UPSWING_MUJOCO_FILE})
      execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/fetch_wheel mujoco ${UPSWING_MUJOCO}
                              ${UPSWING_MACHINE}
                      RESULT_VARIABLE UPSWING_FETCH_FAILED)
      if(UPSWING_FETCH_FAILED)
        message(FATAL_ERROR "MuJoCo 4.0.0 could not be fetched (see above)")
      endif()
    endif()
  endif()
  if(WIN32)  # programs find it in their folder
    file(COPY ${UPSWING_MUJOCO}/lib/mujoco.dll DESTINATION ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
  endif()
  if(NOT TARGET mujoco::mujoco)
    add_library(mujoco::mujoco SHARED IMPORTED)
    set_target_properties(mujoco::mujoco PROPERTIES
      IMPORTED_LOCATION ${UPSWING_MUJOCO}/lib/${UPSWING_MUJOCO_FILE}
      IMPORTED_IMPLIB ${UPSWING_MUJOCO}/lib/${UPSWING_MUJOCO_FILE}  # Windows; MinGW links with the DLL itself
      INTERFACE_INCLUDE_DIRECTORIES ${UPSWING_MUJOCO}/include)
  endif()
endif()
