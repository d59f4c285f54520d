# MuJoCo 4.0.0 as mujoco::mujoco: an installed release where there is one, else the official wheel.
find_package(mujoco 4.0.0 CONFIG QUIET)
if(NOT mujoco_FOUND)
  set(MUJOCO_DIR ${PROJECT_SOURCE_DIR}/build/deps/mujoco-4.0.0)
  if(CMAKE_CROSSCOMPILING)
    string(APPEND MUJOCO_DIR -${CMAKE_SYSTEM_PROCESSOR})
  endif()
  if(NOT EXISTS ${MUJOCO_DIR}/lib/libmujoco.so.4.0.0)
    execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/fetch_wheel mujoco ${MUJOCO_DIR}
                            ${CMAKE_SYSTEM_PROCESSOR}
                    RESULT_VARIABLE MUJOCO_FETCH_FAILED)
    if(MUJOCO_FETCH_FAILED)
      message(FATAL_ERROR "MuJoCo 4.0.0 could not be fetched (see above)")
    endif()
  endif()
  add_library(mujoco::mujoco SHARED IMPORTED)
  set_target_properties(mujoco::mujoco PROPERTIES
    IMPORTED_LOCATION ${MUJOCO_DIR}/lib/libmujoco.so.4.0.0
    INTERFACE_INCLUDE_DIRECTORIES ${MUJOCO_DIR}/include)
endif()
